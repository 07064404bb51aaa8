"""Joint rates of your own arm, with a camera mounted as a hand-eye calibration says."""

from pathlib import Path

import vergence as vg

T_flange_camera = [[0, -1, 0, 0.02], [1, 0, 0, 0], [0, 0, 1, 0.05], [0, 0, 0, 1]]  # of calibration
arm = vg.Arm.from_urdf(Path(__file__).with_name("my_arm.urdf"), tip="tool0")
camera = vg.Camera(640, 480, focal_px=600)
points = vg.Points(camera.normalize([[300, 180], [400, 180], [400, 280], [300, 280]]), depth_m=0.5)
desired = vg.Points(camera.normalize([[270, 190], [370, 190], [370, 290], [270, 290]]), depth_m=0.5)
limits = vg.Limits(order=["view", "joint margin"])
servo = vg.Servo(arm.with_tip(T_flange_camera), camera, vg.ImageBased(gain=2.0), limits=limits)
print(servo.rates(points, desired, q=[0, -1.2, 1.5, -1.6, -1.5, 0]))  # rad/s
