"""A feature of your own, the area of a triangle, stacked with its points.

feature = "my_feature:Area" under [law] uses it in a cell beside this file that tracks three points.
"""

from pathlib import Path

import numpy as np

import vergence as vg


@vg.feature
class Area(vg.Feature):
    """Logarithm of the area of a triangle, a measure of its distance."""

    def value(self) -> np.ndarray:
        """Return s, (1,)."""
        a, b, c = self.points
        return np.log([abs(np.linalg.det([b - a, c - a])) / 2])

    def interaction(self) -> np.ndarray:
        """Return L (1, 6): the points' own, through ∂s/∂points."""
        (a, b, c), (x, y) = self.points, self.points.T
        twice = np.linalg.det([b - a, c - a])
        slope = np.column_stack((np.roll(y, -1) - np.roll(y, 1), np.roll(x, 1) - np.roll(x, -1)))
        return slope.reshape(1, -1) / twice @ vg.Points(self.points, self.depth_m).interaction()


if __name__ == "__main__":
    triangle = np.array([[-0.1, -0.1], [0.1, -0.1], [0.0, 0.1]])
    near, far = vg.Points(1.2 * triangle, 0.5), vg.Points(triangle, 0.6)
    stack = [vg.Term(vg.ImageBased()), vg.Term(vg.ImageBased(feature=Area), weight=0.5)]
    arm = vg.Arm.from_urdf(Path(__file__).with_name("my_arm.urdf"), tip="tool0")
    q = [0, -1.2, 1.5, -1.6, -1.5, 0]
    print(vg.Servo(arm, vg.Camera(640, 480, focal_px=600), stack).rates(near, far, q))
