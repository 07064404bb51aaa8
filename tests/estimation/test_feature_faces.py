"""Which faces of a target show its features, and which a camera has to stay in front of."""

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.estimation import TargetShape
from vergence.estimation.feature_faces import FeatureFaces, face_sines, faces_in_view, shared_faces
from vergence.geometry import se3, se3_inverse, so3_exp

EDGES = np.array([0.16, 0.12, 0.10])
TOP, FRONT = 0.05, 0.08  # heights of two faces of the box
MARKS = np.array([[0.05, 0.04, TOP], [-0.05, 0.04, TOP], [FRONT, 0.04, 0.02], [FRONT, -0.03, 0.0]])
BOX = TargetShape.box(EDGES)


def on_box(points: FloatArray) -> TargetShape:
    """Return the box with other features than its corners."""
    vertices = BOX.surface.triangles.reshape(-1, 3)
    return TargetShape.from_mesh(points, vertices, np.arange(len(vertices)).reshape(-1, 3))


def test_marks_on_a_box_lie_on_its_faces() -> None:
    faces = FeatureFaces.of_shape(on_box(MARKS))
    assert np.allclose(faces.planes, [[0, 0.04, TOP, 0, 0, 1], [FRONT, 0.005, 0.01, 1, 0, 0]])
    assert (faces.holds == [[1, 0], [1, 0], [0, 1], [0, 1]]).all()
    assert faces.sole.all()


def test_corners_of_a_box_lie_on_three_faces_each() -> None:
    faces = FeatureFaces.of_shape(BOX)
    assert len(faces.planes) == 6
    assert (faces.holds.sum(axis=1) == 3).all()
    assert (faces.holds.sum(axis=0) == 4).all()
    assert not faces.sole.any()


def test_flat_points_have_two_sides_and_others_without_a_surface_no_face() -> None:
    square = np.array([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]])
    faces = FeatureFaces.of_points(square)
    assert np.allclose(np.abs(faces.planes), [[0, 0, 0, 0, 0, 1]] * 2)
    assert faces.sole.all()
    for side in (-1.0, 1.0):
        eyes = np.array([[0.1, 0.2, 0.5 * side], [-0.4, 0.0, 0.1 * side]])
        kept = faces.planes[shared_faces(faces.planes, faces.holds, eyes)]
        assert len(kept) == 1
        assert kept[0, 5] == pytest.approx(side)
    assert not len(FeatureFaces.of_points(MARKS).planes)
    assert not len(FeatureFaces.of_shape(TargetShape.from_points(MARKS)).planes)


def test_only_faces_that_all_points_see_are_shared() -> None:
    faces = FeatureFaces.of_shape(on_box(MARKS))
    over, both, beside = [-0.5, 0, 0.5], [0.6, 0, 0.4], [0.6, 0, -0.1]

    def shared(*eyes: list[float]) -> list[bool]:
        kept: list[bool] = shared_faces(faces.planes, faces.holds, np.array(eyes, float)).tolist()
        return kept

    assert shared(both, both) == [True, True]
    assert shared(both, over) == [True, False]
    assert shared(both, beside) == [False, True]
    assert shared(over, beside) == [False, False]


def test_a_corner_is_kept_by_the_face_that_is_seen_best() -> None:
    faces = FeatureFaces.of_shape(BOX)
    eyes = np.array([[0.2, 0.1, 0.9], [0.3, 0.1, 0.8]])  # above all, over three faces
    kept = faces.planes[shared_faces(faces.planes, faces.holds, eyes)]
    top = np.all(BOX.points[:, 2:] > 0, axis=1)
    best = shared_faces(faces.planes, faces.holds[top], eyes)
    assert faces.planes[best, 3:].tolist() == [[0.0, 0.0, 1.0]]
    # A corner of the bottom is seen over a side at most.
    assert set(map(tuple, kept[:, 3:])) == {(0, 0, 1), (1, 0, 0), (0, 1, 0)}


def test_no_straight_way_leads_behind_a_shared_face() -> None:
    faces, random = FeatureFaces.of_shape(BOX), np.random.default_rng(3)
    for _ in range(50):
        eyes = random.uniform(-1, 1, (2, 3))
        kept = faces.planes[shared_faces(faces.planes, faces.holds, eyes)]
        for share in np.linspace(0, 1, 11):
            way = share * eyes[0] + (1 - share) * eyes[1]
            assert (face_sines(way, kept) > 0).all()


def test_a_camera_is_told_the_faces_in_its_own_frame() -> None:
    faces = FeatureFaces.of_shape(on_box(MARKS))
    T = se3(so3_exp(np.array([2.2, 0.3, 1.4])), np.array([0.02, -0.03, 0.6]))
    eye = se3_inverse(T)[:3, 3]
    sines = face_sines(eye, faces.planes)
    assert (sines > 0).tolist() == [True, False]
    shown = faces_in_view(T, faces.planes, faces.holds, np.empty((0, 3)))
    assert face_sines(np.zeros(3), shown) == pytest.approx(sines[:1])
    beside = np.array([[0.6, 0.0, -0.1]])
    assert not len(faces_in_view(T, faces.planes, faces.holds, beside))
