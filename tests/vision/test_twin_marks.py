"""Marks that look like a tracked point are compared with it, whatever is beside them."""

import numpy as np
import pytest

from vergence.studies.honesty.points import KINDS, try_scene

WRONG = 5.0  # deviations


@pytest.mark.parametrize("scene", [93, 601, 979, 1383])
def test_a_mark_is_not_confused_with_one_that_has_other_surroundings(scene: int) -> None:
    answers = try_scene(np.random.default_rng([77, 2, scene]), KINDS.index("look-alikes"))
    assert all(not answer.deviations > WRONG for answer in answers)
