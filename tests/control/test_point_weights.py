"""Weights of image points by the accuracy with which they were measured."""

import numpy as np

from vergence.control.point_weights import point_weights


def test_an_accurate_direction_has_weight_one_and_others_less() -> None:
    covariance = np.array([[[0.01, 0.0], [0.0, 4.0]], [[1.0, 0.3], [0.3, 0.5]]])
    roots = point_weights(covariance)
    assert roots is not None
    weight = roots.transpose(0, 2, 1) @ roots
    ratio = np.linalg.inv(np.eye(2) + covariance / 0.25)
    np.testing.assert_allclose(weight, ratio / np.linalg.eigvalsh(ratio).max(), atol=1e-12)
    assert np.linalg.eigvalsh(weight).max() <= 1.0 + 1e-12


def test_weights_are_contiguous_so_that_no_kernel_is_compiled_for_them_alone() -> None:
    roots = point_weights(np.array([[[0.01, 0.0], [0.0, 4.0]], [[1.0, 0.3], [0.3, 0.5]]]))
    assert roots is not None
    assert roots.flags.c_contiguous


def test_points_that_are_equally_accurate_in_all_directions_have_no_weights() -> None:
    assert point_weights(np.tile(0.3 * np.eye(2), (4, 1, 1))) is None
