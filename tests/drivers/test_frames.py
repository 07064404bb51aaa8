"""Poses from TF: a tree of transforms told one by one, in any order."""

from types import SimpleNamespace

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.assembly.mountings import check_mountings, mounting_keys
from vergence.cell import load_cell
from vergence.drivers.bridges.ros2.frames import Frames
from vergence.drivers.ros2.mounting import pose_between
from vergence.errors import InputError
from vergence.geometry import matrix_to_quaternion, se3, se3_inverse, so3_exp


def message(parent: str, child: str, T: FloatArray, scale: float = 1.0) -> object:
    """One transform as TF tells it."""
    w, x, y, z = scale * matrix_to_quaternion(np.ascontiguousarray(T[:3, :3]))
    transform = SimpleNamespace(
        translation=SimpleNamespace(x=T[0, 3], y=T[1, 3], z=T[2, 3]),
        rotation=SimpleNamespace(x=x, y=y, z=z, w=w),
    )
    header = SimpleNamespace(frame_id=parent)
    told = SimpleNamespace(header=header, child_frame_id=child, transform=transform)
    return SimpleNamespace(transforms=[told])


def drawn(rng: np.random.Generator) -> FloatArray:
    pose: FloatArray = se3(so3_exp(rng.normal(size=3)), rng.normal(size=3))
    return pose


def test_a_pose_is_told_between_any_two_frames_of_a_tree() -> None:
    rng = np.random.default_rng(3)
    parents = {"a": "root", "b": "a", "c": "a", "d": "c"}
    poses = {child: drawn(rng) for child in parents}
    in_root = {"root": np.eye(4)}
    for child, parent in parents.items():
        in_root[child] = in_root[parent] @ poses[child]
    frames = Frames()
    for child in reversed(parents):
        frames.take(message(f"/{parents[child]}", child, poses[child]))
    for one in in_root:
        for other in in_root:
            lines = frames.between(one, other)
            assert lines is not None
            expected = se3_inverse(in_root[one]) @ in_root[other]
            np.testing.assert_allclose(pose_between(*lines), expected, atol=1e-12)
            assert frames.wrong(one, other) == ""


def test_frames_that_are_not_connected_move_or_are_no_poses_are_told_by_name() -> None:
    rng = np.random.default_rng(4)
    frames, T = Frames(), drawn(rng)
    assert frames.wrong("a", "b") == "TF does not connect a with b; it has received no transforms"
    frames.take(message("a", "b", T))
    frames.take(message("b", "head", T))
    frames.take(message("b", "nothing", T, scale=0.0))
    frames.take(message("b", "nothing", T, scale=np.nan))
    assert frames.wrong("a", "nothing") == "TF does not connect a with nothing; it has a, b, head"
    frames.take(message("a", "b", T, scale=-1.0))  # the same rotation
    assert frames.wrong("a", "head") == ""
    frames.take(message("a", "b", T @ se3(so3_exp(np.array([0.0, 0.0, 0.01])), np.zeros(3))))
    assert frames.wrong("a", "head") == "head moves against a in TF, at b"
    assert frames.wrong("b", "head") == ""


def test_a_tree_that_bites_its_tail_is_no_loop() -> None:
    frames, T = Frames(), np.eye(4)
    for parent, child in (("a", "b"), ("b", "c"), ("c", "a")):
        frames.take(message(parent, child, T))
    assert frames.wrong("a", "x").startswith("TF does not connect a with x")
    assert frames.between("a", "c") is not None


def test_a_cell_whose_camera_is_elsewhere_than_the_robot_says_is_refused_with_its_keys() -> None:
    cell, told = (
        load_cell("ur5"),
        se3(so3_exp(np.array([0.0, 0.0, 0.5])), np.array([0.0, 0.0, 0.05])),
    )
    with pytest.raises(
        InputError, match=r"given a mounting 0 mm and 28.6° from .* 28.6479\], which"
    ):
        check_mountings(cell, {"wrist": told})
    turn = str(mounting_keys(told)["rotation_rpy_deg"])
    check_mountings(load_cell("ur5", {"cameras.wrist.rotation_rpy_deg": turn}), {"wrist": told})
