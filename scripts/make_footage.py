#!/usr/bin/env python3
"""Renders footage of known objects: one followed by its outline, one by its edges.

    scripts/make_footage.py

Writes for each of two cells, into the present folder, three images, the model of its target, and
the target's first pose: `vergence track pick --model pick.xml --start pick.json`.
"""

from pathlib import Path

import cv2
import numpy as np

import vergence
from vergence.cell import load_cell
from vergence.simulation import SimulatedDriver

CELLS = Path(vergence.__file__).parent / "cells"

for name, camera in (("lippiello2005", "fixed"), ("pick", "wrist")):
    driver, folder = SimulatedDriver(load_cell(name)), Path(name)
    folder.mkdir()
    for k in range(3):
        cv2.imwrite(str(folder / f"{k}.png"), driver.first_frame(camera).image)
    pose = np.linalg.inv(driver.world.camera_pose(camera)) @ driver.world.target_pose()
    Path(f"{name}.json").write_text(f'{{"T_camera_target": {pose.tolist()}}}')
    Path(f"{name}.xml").write_bytes((CELLS / name / "block.xml").read_bytes())
