"""Features of one image that are too close to each other are not chosen together."""

import numpy as np

from vergence.estimation.spacing import keep_apart

# Two images of four features; in the second one the third is hidden.
PLACES = np.array([[[0.0, 0.0], [3.0, 4.0], [20.0, 0.0], [20.0, 6.0]]] * 2)
VISIBLE = np.array([[True] * 4, [True, True, False, True]])
NONE = np.zeros((2, 4), dtype=bool)


def test_of_two_features_closer_than_the_distance_the_first_stays() -> None:
    kept = keep_apart(VISIBLE, PLACES, NONE, 5.5)  # the first two are 5 px apart, the others 6
    assert kept.tolist() == [[True, False, True, True], [True, False, False, True]]
    assert keep_apart(VISIBLE, PLACES, NONE, 5.0).tolist() == VISIBLE.tolist()


def test_a_feature_chosen_last_time_stays_before_others() -> None:
    held = NONE.copy()
    held[0, 1] = held[0, 3] = True
    kept = keep_apart(VISIBLE, PLACES, held, 10.0)
    assert kept.tolist() == [[False, True, False, True], [True, False, False, True]]


def test_no_distance_keeps_all() -> None:
    assert keep_apart(VISIBLE, PLACES, NONE, 0.0) is VISIBLE
