"""Images and arm poses of a robot that is moved by hand from stop to stop, as a folder."""

from collections import deque
from pathlib import Path

import numpy as np

from vergence.app.calibration.from_bag import flange_pose
from vergence.app.output import warn
from vergence.arrays import FloatArray
from vergence.camera.calibration.arm_poses import write_poses
from vergence.cell import Cell
from vergence.errors import InputError
from vergence.runtime import Driver
from vergence.signals import Frame, JointState

_STILL_S, _STILL = 0.5, 5e-4  # rad or m that no joint moves within, before an image is taken
_APART = 0.01  # rad or m, by which the arm has gone to another stop
_FEWEST = 3


def take_robot_images(cell: Cell, driver: Driver, camera: str, count: int, folder: Path) -> Path:
    """Take an image at each stop of an arm that is moved by hand; nothing is sent to the arm.

    Ctrl-C ends it before there are so many.

    Args:
        cell: whose arm and camera these are.
        driver: of the robot.
        camera: its name.
        count: how many images to take.
        folder: to write to.

    Returns:
        The file of the arm's poses at the images.

    Raises:
        DriverSilent: if the robot does not answer any more.
        InputError: if there were too few stops.
    """
    import cv2

    arm = cell.cameras[camera].arm or cell.task.arm
    pose, stops = flange_pose(cell, arm), Stops()
    taken: dict[str, FloatArray] = {}
    warn(f"Move the arm to {count} poses that show the board, and stop at each for a second.")
    try:
        while len(taken) < count:
            sample = driver.read()
            stops.add(sample.joints[arm])
            for frame in sample.frames:
                if frame.camera == camera and frame.image is not None and stops.is_new(frame, arm):
                    name = f"{len(taken):03d}.png"
                    cv2.imwrite(str(folder / name), frame.image)
                    taken[name] = pose(frame.joints[arm])
                    warn(f"  image {len(taken)} of {count}")
            driver.step({})
    except KeyboardInterrupt:
        warn("  no more images")
    return written_poses(taken, folder)


def written_poses(taken: dict[str, FloatArray], folder: Path) -> Path:
    """Write the poses (4, 4) of the flange at its images, by their names; return the file.

    Raises:
        InputError: if there are too few.
    """
    if len(taken) < _FEWEST:
        given = f"images at {len(taken)} stops of the arm"
        raise InputError("vergence calibrate", "--driver", given, "ten stops or more")
    file = folder / "poses.csv"
    write_poses(file, taken)
    return file


class Stops:
    """Tells at which images an arm has come to rest somewhere new."""

    def __init__(self) -> None:
        self._lately: deque[JointState] = deque()
        self._last: FloatArray | None = None  # where the arm stopped last

    def add(self, joints: JointState) -> None:
        """Take joints; their times increase."""
        self._lately.append(joints)
        while joints.time - self._lately[1].time >= _STILL_S if len(self._lately) > 2 else False:
            self._lately.popleft()

    def is_new(self, frame: Frame, arm: str) -> bool:
        """Return whether an image was exposed at rest, at a stop without one."""
        q, positions = frame.joints[arm], np.array([each.position for each in self._lately])
        known_s = self._lately[-1].time - self._lately[0].time
        moved = float(np.abs(positions - q).max())
        if known_s < _STILL_S or moved > _STILL:
            return False
        if self._last is not None and np.abs(q - self._last).max() < _APART:
            return False
        self._last = q
        return True
