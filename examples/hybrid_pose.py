"""A fixed camera, then that one and another on the arm: how well the arm follows an object.

Both cameras' images are fused into the object's pose, from which the arm keeps its distance.
"""

from vergence.assembly import run_cell
from vergence.cell import load_cell


def main() -> None:
    print("cameras             object known to     arm off by at most")
    for cameras in (["fixed"], ["fixed", "hand"]):
        settings = {"duration_s": "5.0", "perception.cameras": str(cameras)}
        result = run_cell(load_cell("lippiello2005", settings), images=False)
        if not result.outcome.succeeded:
            raise SystemExit(str(result.outcome))
        error = result.summary
        print(
            f"{' and '.join(cameras):20s}"
            f"{1e3 * error['final_target_error_m']:.1f} mm, {error['final_target_error_deg']:.2f}°"
            f"{1e3 * error['max_pose_error_m']:12.1f} mm, {error['max_pose_error_deg']:.2f}°"
        )


if __name__ == "__main__":
    main()
