"""A fixed camera and one in the hand, fused into the object's pose, which the hand follows."""

from vergence.cell import load_cell
from vergence.runtime import run_cell


def main() -> None:
    for cameras in ('["fixed"]', '["fixed", "hand"]'):
        settings = {"duration_s": "5.0", "perception.cameras": cameras}
        result = run_cell(load_cell("lippiello2005", settings), images=False)
        print(cameras, result.outcome)
        for name, value in sorted(result.summary.items()):
            print(f"  {name:32s} {value:.4g}")


if __name__ == "__main__":
    main()
