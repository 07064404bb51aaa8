"""Images and arm poses of a ROS 2 bag, as a folder to calibrate from."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.arm_poses import write_poses
from vergence.errors import Absent, InputError, nearest
from vergence.geometry import se3_inverse
from vergence.runtime.bags import COMPRESSED, IMAGE, Bag, BagJoints

if TYPE_CHECKING:
    from vergence.cell import Cell
    from vergence.simulation.cell_model import CellModel

_MOST_IMAGES = 60  # without an arm, evenly spread
_STILL_S, _STILL = 0.2, 5e-4  # rad or m that no joint moves within, before and after an image
_APART = 0.01  # rad or m, by which the arm has gone to another stop
_FEWEST_STOPS = 3


class ArmOfBag(NamedTuple):
    """The arm whose joints a bag has."""

    cell: str  # that has the arm
    joints: str | None  # topic of its joint states; the only one if None


def write_bag_images(
    path: Path, topic: str | None, arm: ArmOfBag | None, folder: Path
) -> Path | None:
    """Write images of a bag into a folder: some, or with an arm one from each of its stops.

    Args:
        path: of the bag.
        topic: of the images; the only one if None.
        arm: whose poses to take; None for none.
        folder: to write to.

    Returns:
        The file of the arm's poses at the images; None without an arm.

    Raises:
        InputError: if the bag cannot be read, or the arm does not stop.
    """
    import cv2

    with Bag(path) as bag:
        chosen = bag.image_topic(topic)
        count = bag.topics(IMAGE, COMPRESSED)[chosen]
        poses = None if arm is None else _Poses(bag, arm)
        every = -(-count // _MOST_IMAGES)
        taken: dict[str, FloatArray] = {}
        for number, image in enumerate(bag.images(chosen)):
            T = np.eye(4) if poses is None else poses.at_stop(image.time)
            if T is not None and (poses is not None or number % every == 0):
                name = f"{number:06d}.png"
                cv2.imwrite(str(folder / name), image.raw())
                taken[name] = T
    if poses is None:
        return None
    if len(taken) < _FEWEST_STOPS:
        given = f"images at {len(taken)} stops of the arm"
        allowed = (
            "at least ten stops of half a second; an image taken in motion has no reliable pose"
        )
        raise InputError(str(path), "", given, allowed)
    file = folder / "poses.csv"
    write_poses(file, taken)
    return file


def flange_pose(
    cell: "Cell", arm: str, model: "CellModel | None" = None
) -> Callable[[FloatArray], FloatArray]:
    """Return what gives T_base_flange (4, 4) of a cell's arm at joint positions (n,)."""
    from vergence.simulation.cell_model import CellModel
    from vergence.simulation.motion import placement_pose

    to_body = (model or CellModel(cell)).arm_to_body(arm)
    T_base_world = se3_inverse(placement_pose(cell.arms[arm]))

    def pose(q: FloatArray) -> FloatArray:
        T: FloatArray = T_base_world @ to_body.forward_kinematics(q)
        return T

    return pose


class _Poses:
    """Where the flange was, by the joints of a bag and the arm of a cell."""

    def __init__(self, bag: Bag, arm: ArmOfBag) -> None:
        from vergence.cell import load_cell
        from vergence.simulation.cell_model import CellModel

        cell = load_cell(arm.cell)
        joints = bag.joints(bag.joint_topic(arm.joints))
        model = CellModel(cell)
        named = {n: a for n, a in model.arms.items() if set(a.names) <= set(joints.names)}
        if not named:
            names = next(iter(model.arms.values())).names
            missing = next(name for name in names if name not in joints.names)
            given = Absent(f"no joint {missing} in {bag.path}")
            raise InputError("vergence calibrate", "--cell", given, nearest(missing, joints.names))
        name = next(iter(named))
        self._joints: BagJoints = joints.of(tuple(named[name].names), str(bag.path))
        self._pose = flange_pose(cell, name, model)
        self._last: FloatArray | None = None  # where the arm stopped last

    def at_stop(self, time: float) -> FloatArray | None:
        """Return T_base_flange (4, 4) at the first image of a new stop; None at any other."""
        if not self._joints.time[0] <= time - _STILL_S <= self._joints.time[-1] - 2 * _STILL_S:
            return None
        q = self._at(time)
        around = self._at(time - _STILL_S), self._at(time + _STILL_S)
        if max(float(np.abs(other - q).max()) for other in around) > _STILL:
            return None
        if self._last is not None and np.abs(q - self._last).max() < _APART:
            return None
        self._last = q
        return self._pose(q)

    def _at(self, time: float) -> FloatArray:
        columns = self._joints.position.T
        return np.array([np.interp(time, self._joints.time, column) for column in columns])
