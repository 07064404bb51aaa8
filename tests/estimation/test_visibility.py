from dataclasses import replace

import numpy as np
import pytest
from estimation_scene import CAMERA, look_at

from vergence.camera import Camera
from vergence.camera.lens import is_one_to_one, pixel_of
from vergence.errors import InputError
from vergence.estimation import (
    CameraRig,
    TargetShape,
    ViewStatus,
    add_obstacles,
    predict_visibility,
)
from vergence.geometry import se3, se3_compose, se3_inverse, so3_exp, transform_points

RIG = CameraRig.of({"one": CAMERA}, 1.0)
BOX = TargetShape.box((0.2, 0.2, 0.2))


def seen(shape, T_world_camera, T_world_target=None, **kwargs):
    T = np.eye(4) if T_world_target is None else T_world_target
    T_camera_target = se3_compose(se3_inverse(T_world_camera), T)[None]
    return predict_visibility(shape, T_camera_target, RIG.lenses, **kwargs)


def el_shape():
    """A concave bracket: a low slab with an upright wall on one side, features on its corners."""
    slab, wall = TargetShape.box((0.2, 0.2, 0.05)), TargetShape.box((0.02, 0.2, 0.2))
    up = np.array([0.09, 0.0, 0.125])
    triangles = np.vstack((slab.surface.triangles, wall.surface.triangles + up))
    vertices = triangles.reshape(-1, 3)
    points = np.vstack((slab.points, wall.points + up))
    return TargetShape.from_mesh(points, vertices, np.arange(len(vertices)).reshape(-1, 3))


def test_box_has_three_faces_at_each_corner_that_point_outward():
    np.testing.assert_array_equal(BOX.face_counts, 3)
    for point, normals in zip(BOX.points, BOX.normals, strict=True):
        np.testing.assert_allclose(normals @ point, 0.1)
    assert BOX.size == pytest.approx(0.2 * np.sqrt(3))


def test_seven_corners_of_a_box_are_seen_from_a_corner_and_four_from_the_front():
    assert seen(BOX, look_at((0.8, 0.8, 0.8))).visible.sum() == 7
    front = seen(BOX, look_at((1.0, 0.0, 0.0)))
    assert front.visible.sum() == 4
    assert set(front.status[0][~front.visible[0]]) == {ViewStatus.TURNED_AWAY}


def test_visible_corners_of_a_box_agree_with_a_dense_search():
    # Twin: a corner is seen if the segment towards it does not pass through the open box.
    rng = np.random.default_rng(1)
    for _ in range(40):
        eye = rng.standard_normal(3)
        eye *= rng.uniform(0.7, 1.5) / np.linalg.norm(eye)
        sight = seen(BOX, look_at(eye), least_cosine=0.0).status[0]
        for point, found in zip(BOX.points, sight, strict=True):
            along = eye + np.linspace(0.0, 1.0, 4000)[:, None] * (point - eye)
            inside = (np.abs(along) < 0.1 - 1e-6).all(axis=1).any()
            assert (found == ViewStatus.VISIBLE) != inside


def test_predicted_places_are_the_cameras_own_projection():
    camera = Camera(640, 480, 500.0, 520.0, 320.0, 240.0, np.array([-0.2, 0.05, 1e-3, -2e-3, 0.01]))
    rig = CameraRig.of({"bent": camera}, 0.5)
    T = look_at((0.5, 0.6, 0.7))
    predicted = predict_visibility(BOX, se3_inverse(T)[None], rig.lenses)
    expected = camera.project(transform_points(se3_inverse(T), BOX.points))
    np.testing.assert_allclose(predicted.points_px[0], expected, atol=1e-10)
    depth = transform_points(se3_inverse(T), BOX.points)[:, 2]
    np.testing.assert_allclose(predicted.depth[0], depth, atol=1e-15)


def test_points_beyond_the_bend_of_the_distortion_are_not_folded_into_the_image():
    camera = Camera(640, 480, 400.0, 400.0, 320.0, 240.0, np.array([-0.3, 0.0, 0.0, 0.0, 0.0]))
    lens = CameraRig.of({"bent": camera}, 0.5).lenses[0]
    assert camera.contains(np.array([pixel_of(lens, 1.8, 0.0)]))[0]
    assert not is_one_to_one(lens, 1.8, 0.0)


def test_features_outside_behind_or_near_the_border_are_named_so():
    away = look_at((1.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    assert set(seen(BOX, away).status[0]) == {ViewStatus.BEHIND}
    aside = look_at((1.0, 0.0, 0.0), (0.0, 5.0, 0.0))
    assert set(seen(BOX, aside).status[0]) == {ViewStatus.OUTSIDE}
    bare = TargetShape.from_points([[0.0, 0.0, 0.0]])
    centred = look_at((1.0, 0.0, 0.0))
    assert seen(bare, centred, margin_px=280.0).status[0, 0] == ViewStatus.VISIBLE
    assert seen(bare, centred, margin_px=290.0).status[0, 0] == ViewStatus.OUTSIDE


def test_bare_points_are_seen_from_all_sides():
    bare = TargetShape.from_points(BOX.points)
    for eye in ((1.0, 0.1, 0.2), (-1.0, 0.3, 0.4), (0.1, 0.2, -1.0)):
        assert seen(bare, look_at(eye)).visible.all()


def test_concave_target_hides_its_own_corners():
    shape = el_shape()
    behind_wall = seen(shape, look_at((1.0, 0.0, 0.15)))
    hidden = behind_wall.status[0] == ViewStatus.HIDDEN
    # the far upper corners of the slab face upwards, yet the wall stands before them
    far_upper = (shape.points[:, 0] < 0.0) & (shape.points[:, 2] > 0.02)
    assert far_upper.sum() == 2
    assert hidden[far_upper].all()
    free_side = seen(shape, look_at((-1.0, 0.0, 0.15)))
    assert free_side.visible[0][far_upper].all()


def test_features_that_cannot_be_hidden_are_seen_as_if_they_were_tried():
    rng = np.random.default_rng(2)
    for shape, safe in ((BOX, 8), (el_shape(), 6)):
        assert (~shape.may_be_hidden).sum() == safe
        tried = replace(shape, may_be_hidden=np.ones(len(shape.points), dtype=np.bool_))
        for _ in range(50):
            eye = rng.standard_normal(3)
            T = look_at(eye * rng.uniform(0.5, 1.5) / np.linalg.norm(eye))
            np.testing.assert_array_equal(seen(shape, T).status, seen(tried, T).status)


def test_visibility_does_not_depend_on_where_the_world_is():
    T = se3(so3_exp(np.array([0.4, -0.8, 1.1])), np.array([3.0, -1.0, 2.0]))
    eye = look_at((0.7, -0.6, 0.5))
    shape = el_shape()
    here, there = seen(shape, eye), seen(shape, T @ eye, T)
    np.testing.assert_array_equal(here.status, there.status)
    np.testing.assert_allclose(here.points_px, there.points_px, atol=1e-8)


def test_obstacles_are_asked_about_visible_features_only():
    asked = []

    def blocked(origin, points):
        asked.append(len(points))
        return points[:, 2] > 0.0

    eye = look_at((0.8, 0.8, 0.8))
    sight = seen(BOX, eye).status[0]
    add_obstacles(sight, blocked, eye[:3, 3], BOX.points)
    assert asked == [7]
    assert set(sight[BOX.points[:, 2] > 0.0]) == {ViewStatus.BLOCKED}
    assert (sight[BOX.points[:, 2] < 0.0] == ViewStatus.VISIBLE).sum() == 3


def test_targets_without_features_and_torn_meshes_are_refused():
    with pytest.raises(InputError, match="points"):
        TargetShape.from_points(np.zeros((0, 3)))
    with pytest.raises(InputError, match="faces"):
        TargetShape.from_mesh([[0, 0, 0]], np.zeros((3, 3)), [[0, 1, 3]])


def test_rigs_without_cameras_or_noise_are_refused():
    with pytest.raises(InputError, match="cameras"):
        CameraRig.of({}, 1.0)
    with pytest.raises(InputError, match=r"noise_px\.one"):
        CameraRig.of({"one": CAMERA}, {"on": 1.0})
    with pytest.raises(InputError, match="noise_px"):
        CameraRig.of({"one": CAMERA}, 0.0)
