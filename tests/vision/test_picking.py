import numpy as np
import pytest
from numpy.typing import NDArray

from vergence.errors import ShapeError
from vergence.vision import pick_features


def squares(*centres: tuple[int, int], side: int = 24) -> NDArray[np.uint8]:
    image = np.full((200, 260), 60, np.uint8)
    for x, y in centres:
        image[y - side // 2 : y + side // 2, x - side // 2 : x + side // 2] = 200
    return image


def test_corners_lie_in_the_windows_of_the_picks_and_edges_are_not_picked() -> None:
    picked = pick_features(squares((120, 100), side=60), 4, apart_px=30.0)
    corners = np.array([[89.5, 69.5], [149.5, 69.5], [89.5, 129.5], [149.5, 129.5]])
    assert len(picked.points_px) == 4
    for corner in corners:
        assert np.min(np.abs(picked.points_px - corner).max(axis=1)) <= 8.0


def test_a_straight_edge_with_noise_is_not_picked() -> None:
    rows, columns = np.indices((200, 260))
    side = np.clip(columns - 0.7 * rows - 60.0, -1.0, 1.0)
    noise = np.random.default_rng(6).normal(0.0, 4.0, side.shape)
    image = np.clip(128 + 110 * side + noise, 0, 255).astype(np.uint8)
    assert not pick_features(image, 5)


def test_fine_pattern_that_vanishes_at_the_coarse_level_is_not_picked() -> None:
    image = squares((200, 100))
    rows, columns = np.indices((60, 60))
    image[60:120, 40:100] = np.where((rows + columns) % 2, 40, 200)
    image[:, :140][image[:, :140] == 60] = 120  # the pattern's mean: no edge around it when coarse
    picked = pick_features(image, 3)
    assert picked
    assert (picked.points_px[:, 0] > 140).all()


def test_picks_keep_their_distance_and_are_sorted_by_worth() -> None:
    image = np.random.default_rng(4).integers(0, 255, (20, 26)).repeat(10, 0).repeat(10, 1)
    picked = pick_features(image, 12, apart_px=25.0)
    gaps = np.linalg.norm(picked.points_px[:, None] - picked.points_px[None], axis=2)
    assert len(picked.points_px) == 12
    assert gaps[~np.eye(12, dtype=bool)].min() >= 25.0
    assert (np.diff(picked.worth) <= 0).all()


def test_picks_stay_inside_the_mask() -> None:
    image = squares((60, 60), (200, 140))
    mask = np.zeros(image.shape, bool)
    mask[:, 130:] = True
    picked = pick_features(image, 3, mask)
    assert picked
    assert (picked.points_px[:, 0] >= 129).all()


def test_nothing_to_pick_is_a_falsy_result_with_reason() -> None:
    picked = pick_features(np.full((100, 100), 90, np.uint8), 5)
    assert not picked
    assert "no texture" in picked.reason
    assert pick_features(np.zeros((0, 0), np.uint8), 5).reason == "image empty"


def test_too_few_points_say_so() -> None:
    picked = pick_features(squares((130, 100)), 50)
    assert picked
    assert "of 50 points" in picked.reason


def test_mask_of_another_shape_is_an_error() -> None:
    with pytest.raises(ShapeError, match="mask"):
        pick_features(squares((130, 100)), 5, np.ones((3, 3), bool))
