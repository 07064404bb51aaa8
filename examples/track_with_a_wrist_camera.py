"""Follow a moving board with a camera on a Puma, with every part assembled by hand."""

import numpy as np

from vergence.cell import load_cell
from vergence.control import OptimalTracking, PseudoInverse, Servo
from vergence.estimation import TrackedPoints
from vergence.planning import FixedReference
from vergence.runtime import Loop
from vergence.signals import Reference
from vergence.simulation import SimulatedDriver
from vergence.vision import SsdTracker, pick_features


def main() -> None:
    cell = load_cell("puma560", {"target.motion.velocity_m_s": "[0.05, 0.05, 0.0]"})
    driver = SimulatedDriver(cell)
    image = driver.first_frame("wrist").image
    assert image is not None
    points = pick_features(image, 4).points_px
    law = Servo(
        driver.world.arm_to_camera("wrist"),
        driver.cameras["wrist"],
        OptimalTracking(axes=("x", "y", "rx", "ry"), avoidance_axes=("x", "y"), S=0.001),
        solver=PseudoInverse(),
        depth_m=1.0,
    )
    tracker = SsdTracker(image, points)
    seen = TrackedPoints("wrist", tracker)
    goal = FixedReference(Reference(0.0, points))
    board = driver.world.target_pose()
    outcome = Loop(driver, "puma", seen, goal, law, outer_rate_hz=30).run(duration_s=3.0)
    print(outcome)
    moved = 100 * (driver.world.target_pose() - board)[:2, 3]
    print(f"the board moved by {moved[0]:.0f} cm along x and {moved[1]:.0f} cm along y")
    off = np.abs(tracker.points_px - points).max()
    print(f"its points are within {off:.0f} px of where the camera saw them first")
    driver.close()


if __name__ == "__main__":
    main()
