"""Servo with the grey values of a whole image, coarse to fine, from various distances.

A camera 0.5 m before a textured plane starts away from its goal. It arrives if the image still
resembles the desired one; on coarser levels of the pyramid that reaches farther.
"""

import cv2
import numpy as np

import vergence as vg
from vergence.features import Luminance
from vergence.geometry import se3, se3_exp, se3_inverse

CAMERA = vg.Camera(160, 120, focal_px=150)
DEPTH = 0.5  # m, believed of all that is seen
GOAL = se3(np.eye(3), np.array([0.0, 0.0, DEPTH]))  # of the plane in the camera
rng = np.random.default_rng(0)
SIDE = 1000  # texture of 1 mm a pixel, as rough on every scale
TEXTURE = sum(
    cv2.resize(rng.normal(0, 1, (SIDE // n, SIDE // n)), (SIDE, SIDE), interpolation=3) * n**0.5
    for n in (4, 10, 25, 50)
)
TEXTURE = (128 + 14 * TEXTURE).clip(0, 255).astype(np.float32)
ON_PLANE = np.array([[1e-3, 0, -0.5], [0, 1e-3, -0.5], [0, 0, 1]])  # m, from pixels


def seen(T_camera_plane):
    plane = T_camera_plane[:3, [0, 1, 3]]
    image = cv2.warpPerspective(TEXTURE, CAMERA.matrix @ plane @ ON_PLANE, (160, 120))
    return (image + rng.normal(0, 2, image.shape)).clip(0, 255).astype(np.uint8)


def arrives(T, levels):
    desired = seen(GOAL)
    for level in levels:
        goal = Luminance(desired, CAMERA, DEPTH, level)
        for _ in range(12):
            v_camera = Luminance(seen(T), CAMERA, DEPTH, level).twist(goal)
            T = se3_exp(-0.7 * v_camera) @ T  # by 0.7 s
    off = se3_inverse(GOAL.copy()) @ T
    return np.linalg.norm(off[:3, 3]) < 1e-3


print("starts that arrive within 1 mm, of 10:    all levels    finest alone")
for size in (0.01, 0.03, 0.06):  # m, and twice as many rad
    directions = rng.normal(size=(10, 6)) * [1, 1, 1, 2, 2, 2]
    starts = [se3_exp(size * d / np.linalg.norm(d[:3])) @ GOAL for d in directions]
    counts = [sum(arrives(T, levels) for T in starts) for levels in ((3, 2, 1, 0), (0,))]
    print(f"    {1e3 * size:3.0f} mm away {counts[0]:28d} {counts[1]:15d}")
