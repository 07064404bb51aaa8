"""The pose of a box from the corners that two cameras see."""

import numpy as np

import vergence as vg

box = 0.1 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
camera = vg.Camera(640, 480, focal_px=600)
T_left, T_right = np.eye(4), np.eye(4)
T_right[:3, 3] = 0.5, 0.0, 0.1
seen = [camera.project(box + [0.2, 0.05, 1.2] - T[:3, 3]) for T in (T_left, T_right)]
views = [vg.CornerView(camera, T, px) for T, px in zip((T_left, T_right), seen, strict=True)]
fit = vg.fit_pose(box, views)
print(fit.T_world_target.round(4) if fit else fit.reason)
