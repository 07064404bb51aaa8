"""A whole law of your own: kind = "my_law:Transpose" under [law] in a cell beside this file.

vergence compare CELL --laws own,my_law:Transpose compares it with others.
"""

import numpy as np

import vergence as vg
from vergence.control import LawSetting
from vergence.signals import JointCommand, JointState, Observation, Reference


@vg.part("law")
class Transpose:
    """v = -λ Lᵀ e: no inverse anywhere, slow but hard to upset."""

    gain: float = vg.knob(0.4, "1/s", above=0, upto=10)  # decay rate λ of the error

    def bind(self, setting: LawSetting) -> "TransposeLaw":
        """Return the law for an arm and its cameras."""
        return TransposeLaw(self.gain, setting)


class TransposeLaw:
    """The same, made for one arm with a camera at its tip."""

    def __init__(self, gain: float, setting: LawSetting) -> None:
        self._gain, self._arm = gain, setting.arm
        name, mounting = next(iter(setting.cameras.items()))
        self._camera, self._depth_m = mounting.camera, setting.depth_m[name]

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        view = observation.views[-1]
        points_px = np.array([view.points_px, reference.points_px])[:, view.found]
        if not len(points_px[0]):
            return JointCommand(np.zeros(len(joints.position)), np.zeros(6))
        seen, desired = map(self._camera.normalize, points_px)
        L = vg.Points(seen, self._depth_m[view.found]).interaction()
        v_camera = -self._gain * L.T @ (seen - desired).ravel()
        return JointCommand(
            np.linalg.pinv(self._arm.jacobian(joints.position)) @ v_camera, v_camera
        )


if __name__ == "__main__":
    run = vg.run("puma560", images=False, duration_s=0.5, law={"kind": "my_law:Transpose"})
    print(run.outcome)
