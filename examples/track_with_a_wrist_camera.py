"""Follow a moving board with the camera in a Puma's hand, every part put together by hand."""

from vergence.cell import SimulatedDriver, load_cell
from vergence.control import OptimalTrackingLaw
from vergence.estimation import TrackedPoints
from vergence.planning import FixedReference, Reference
from vergence.runtime import Loop
from vergence.vision import SsdTracker, pick_features


def main() -> None:
    cell = load_cell("puma560", {"target.motion.velocity_m_s": "[0.05, 0.05, 0.0]"})
    driver = SimulatedDriver(cell)
    image = driver.first_frame("wrist").image
    assert image is not None
    points = pick_features(image, 4).points_px
    law = OptimalTrackingLaw(
        driver.world.arm_to_camera("wrist"),
        driver.cameras["wrist"],
        depth_m=[1.0] * len(points),
        axes=("x", "y", "rx", "ry"),
        avoidance_axes=("x", "y"),
        Q=2e-6 / len(points),
        S=0.001,
    )
    seen = TrackedPoints("wrist", SsdTracker(image, points))
    goal = FixedReference(Reference(0.0, points))
    outcome = Loop(driver, "puma", seen, goal, law, outer_rate_hz=30).run(duration_s=3.0)
    print(outcome)
    driver.close()


if __name__ == "__main__":
    main()
