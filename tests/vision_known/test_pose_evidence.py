"""Poses are compared by the edges that only one of them predicts; the right one is not excluded."""

import cv2
import numpy as np
import pytest
from known_scene import CAMERA, box_model, clutter, drawn_image, off, pose
from test_hypothesis_follower import drawn, wedge

from vergence.arrays import FloatArray, ImageArray
from vergence.estimation.known_object.object_rivals import DECIDED
from vergence.geometry import angle_between, se3, so3_exp
from vergence.vision.known_object import EdgeTracker
from vergence.vision.known_object.edge_measurement import EdgeMeasurement
from vergence.vision.known_object.pose_evidence import beside

CHANCE = 0.5
START = np.diag(np.repeat([0.01, 0.1], 3) ** 2)  # covariance around each start
SPOILT = {
    "clean": lambda image, _: image,
    "blurred": lambda image, _: cv2.GaussianBlur(image, (0, 0), 2.0),
    "strongly blurred": lambda image, _: cv2.GaussianBlur(image, (0, 0), 4.0),
    "smeared": lambda image, _: cv2.blur(image, (7, 1)),
    "dark": lambda image, random: np.clip(0.2 * image + random.normal(0, 2, image.shape), 0, 255),
}


def measured(tracker: EdgeTracker, image: ImageArray, T: FloatArray) -> EdgeMeasurement:
    start = np.ascontiguousarray(T)
    return tracker.measure(image, CAMERA, start, START, tracker.blank())


def turned(T: FloatArray, axis: int, angle: float) -> FloatArray:
    return T @ se3(so3_exp(angle * np.eye(3)[axis]), np.zeros(3))


@pytest.mark.parametrize("light", [1.0, 0.2])
def test_a_turned_box_is_excluded_and_the_ratio_the_other_way_is_opposite(light: float) -> None:
    random, tracker = np.random.default_rng(0), EdgeTracker(box_model())
    image = drawn_image(pose(), random, clutter(random), noise=2.0, light=light)
    right = measured(tracker, image, pose())
    for axis in range(3):
        wrong = measured(tracker, image, turned(pose(), axis, 0.5 * np.pi))
        ratio = tracker.log_ratio(right, wrong, CAMERA, CHANCE)
        assert ratio > DECIDED
        assert tracker.log_ratio(wrong, right, CAMERA, CHANCE) == -ratio


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_poses_that_predict_the_same_edges_are_equal_however_well_they_fit(axis: int) -> None:
    random, tracker = np.random.default_rng(1), EdgeTracker(box_model())
    image = drawn_image(pose(), random, clutter(random))
    right = measured(tracker, image, pose())
    twin = measured(tracker, image, turned(pose(), axis, np.pi))
    assert tracker.log_ratio(right, twin, CAMERA, CHANCE) == pytest.approx(0.0, abs=0.5)


def test_the_more_is_found_by_chance_the_less_the_edges_say() -> None:
    random, tracker = np.random.default_rng(2), EdgeTracker(box_model())
    image = drawn_image(pose(), random, clutter(random))
    right = measured(tracker, image, pose())
    wrong = measured(tracker, image, turned(pose(), 0, 0.5 * np.pi))
    ratios = [tracker.log_ratio(right, wrong, CAMERA, chance) for chance in (0.3, 0.6, 0.9)]
    assert ratios == sorted(ratios, reverse=True)


def test_an_edge_that_is_missing_altogether_may_lack_contrast() -> None:
    random, tracker = np.random.default_rng(3), EdgeTracker(box_model())
    right = measured(tracker, drawn_image(pose(), random), pose())
    wrong = measured(tracker, drawn_image(pose(), random), turned(pose(), 0, 0.5 * np.pi))
    edges = np.unique(right.samples.edge)
    whole = tracker.log_ratio(right, wrong, CAMERA, CHANCE)
    for edge in edges:
        found = right.samples_found & (right.samples.edge != edge)
        one_missing = right._replace(samples_found=found)
        assert whole - tracker.log_ratio(one_missing, wrong, CAMERA, CHANCE) < np.log(1e3)


@pytest.mark.parametrize("spoilt", SPOILT)
@pytest.mark.parametrize("cut", [0.002, 0.004, 0.01, 0.02])
def test_the_right_pose_is_never_excluded(spoilt: str, cut: float) -> None:
    tracker, decided = EdgeTracker(wedge(cut)), 0
    for seed in range(12):
        random = np.random.default_rng([seed, int(1e3 * cut)])
        R = so3_exp(random.uniform(-np.pi, np.pi, 3))
        T = se3(R, np.array([*random.uniform(-0.02, 0.02, 2), random.uniform(0.3, 0.5)]))
        image = SPOILT[spoilt](drawn(cut, T, random, clutter(random)), random).astype(np.uint8)
        right = measured(tracker, image, off(T, random, 0.002, 0.02))
        if angle_between(right.T_camera_target, T) > 0.05:
            continue
        for axis in range(3):
            for quarters in (1, 2, 3):
                start = turned(T, axis, 0.5 * np.pi * quarters)
                wrong = measured(tracker, image, start)
                chance = float(np.clip(wrong.share, 0.3, 0.9))
                ratio = tracker.log_ratio(right, wrong, CAMERA, chance)
                assert ratio > -DECIDED, (seed, axis, quarters)
                decided += ratio > DECIDED
    assert decided > 20


def test_places_coincide_beside_each_other_on_parallel_edges_only() -> None:
    across = np.array([[1.0, 0.0]])
    place = np.array([[50.0, 50.0]])
    for other, normal, apart_px, expected in (
        ((51.0, 58.0), (1.0, 0.0), 1.5, True),
        ((51.0, 58.0), (-1.0, 0.0), 1.5, True),
        ((52.0, 50.0), (1.0, 0.0), 1.5, False),
        ((52.0, 50.0), (1.0, 0.0), 3.0, True),
        ((50.0, 62.0), (1.0, 0.0), 1.5, False),
        ((50.0, 50.0), (0.0, 1.0), 1.5, False),
    ):
        found = beside(place, across, np.array([other]), np.array([normal]), apart_px)
        assert bool(found[0]) is expected
