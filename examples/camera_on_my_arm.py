"""Where a camera is, and how it moves with the joints of one's own arm."""

from pathlib import Path

import vergence as vg

T_flange_camera = [[0, -1, 0, 0.02], [1, 0, 0, 0], [0, 0, 1, 0.05], [0, 0, 0, 1]]  # of calibration
arm = vg.Arm.from_urdf(Path(__file__).with_name("my_arm.urdf"), tip="tool0")
eye = arm.with_tip(T_flange_camera)
q = [0, -1.2, 1.5, -1.6, -1.5, 0]
print("camera at", eye.forward_kinematics(q)[:3, 3].round(3), "m in the world")
print("v_camera of the first joint alone:", eye.jacobian(q)[:, 0].round(3))
