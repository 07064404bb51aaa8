"""Random scenes whose motion was once stated too certain, or not at all."""

import numpy as np
import pytest

from vergence.studies.honesty.two_views import (
    CAMERA,
    NOISE_PX,
    REFERENCE,
    Scene,
    deviations,
    draw_scene,
)
from vergence.vision.two_view import TwoView, TwoViewFailure, estimate_two_view


def drawn(kind: str, *seed: int) -> tuple[Scene, TwoView | TwoViewFailure]:
    scene = draw_scene(np.random.default_rng(seed), kind)
    found = estimate_two_view(
        scene.current_px, scene.desired_px, CAMERA, noise_px=NOISE_PX, reference=REFERENCE
    )
    return scene, found


@pytest.mark.parametrize("number", [453, 743, 996, 1775])
def test_wrong_matches_on_their_epipolar_lines_do_not_turn_the_motion(number: int) -> None:
    scene, found = drawn("general", 7, number)
    assert isinstance(found, TwoView)
    assert deviations(found, scene) < 3.0


@pytest.mark.parametrize("number", [868, 1999])
def test_a_reference_plane_seen_almost_edge_on_is_uncertain(number: int) -> None:
    scene, found = drawn("general", 11, number)
    assert isinstance(found, TwoView)
    assert deviations(found, scene) < 3.0


def test_noise_that_is_by_chance_small_in_few_residuals_may_be_larger() -> None:
    scene, found = drawn("general", 11, 742)
    assert isinstance(found, TwoView)
    assert deviations(found, scene) < 3.0


def test_a_match_without_which_nothing_is_known_is_no_error() -> None:
    _, found = drawn("plane", 11, 1538)
    assert isinstance(found, TwoView | TwoViewFailure)
