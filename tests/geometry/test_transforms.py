"""Geometry for people: lists in, a wrong shape named, the kernels' own results."""

import numpy as np
import pytest

import vergence.geometry as kernels
from vergence.errors import InputError, ShapeError
from vergence.geometry import transforms

TURNED = [[0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, 0.2], [0, 0, 0, 1]]


def test_every_kernel_has_its_function() -> None:
    compiled = [name for name in kernels.__all__ if hasattr(getattr(kernels, name), "py_func")]
    assert len(compiled) > 15
    for name in compiled:
        assert getattr(transforms, name).__name__ == name
        assert getattr(transforms, name) is not getattr(kernels, name)


def test_every_public_name_is_there() -> None:
    assert {"angle_between", "so3_angle", "flat_normal", "se3_log"} <= set(transforms.__all__)
    for name in transforms.__all__:
        assert callable(getattr(transforms, name))


def test_lists_and_arrays_of_any_type_and_order_are_taken() -> None:
    pose = np.array(TURNED)
    expected = kernels.se3_inverse(pose)
    read_only = pose.copy()
    read_only.flags.writeable = False
    for given in (TURNED, pose, np.asfortranarray(pose), pose.astype(np.float32), read_only):
        np.testing.assert_allclose(transforms.se3_inverse(given), expected, atol=1e-7)
    np.testing.assert_allclose(transforms.transform_points(TURNED, [[1, 2, 3]]), [[-1.9, 1, 3.2]])
    assert transforms.se3_distance(TURNED, T_b=TURNED, length=1) == 0.0


def test_a_wrong_shape_is_named() -> None:
    with pytest.raises(ShapeError, match=r"twist has shape \(5,\); it must have shape \(6,\)"):
        transforms.se3_exp([0, 0, 0, 0, 0])
    with pytest.raises(ShapeError, match="points_b"):
        transforms.transform_points(TURNED, [1, 2, 3])
    with pytest.raises(InputError, match="an array of numbers"):
        transforms.so3_exp(["x", "y", "z"])
    with pytest.raises(TypeError, match="missing"):
        transforms.se3_compose(TURNED)
