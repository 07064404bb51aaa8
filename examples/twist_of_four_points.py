"""The camera twist that moves four image points towards their desired positions."""

import vergence as vg

camera = vg.Camera(640, 480, focal_px=600)
points = vg.Points(camera.normalize([[300, 180], [400, 180], [400, 280], [300, 280]]), depth_m=0.5)
desired = vg.Points(camera.normalize([[270, 190], [370, 190], [370, 290], [270, 290]]), depth_m=0.5)
print(vg.ImageBased(gain=1.0).twist(points, desired))  # v_camera, (6,): m/s and rad/s
