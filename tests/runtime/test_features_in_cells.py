"""Features by name in a cell: they arrive, stacked too, and what does not fit is refused."""

from typing import Any

import pytest

import vergence as vg

STACK = [
    {"kind": "image_based", "feature": "centre"},
    {"kind": "image_based", "feature": "size"},
    {"kind": "image_based", "feature": "orientation"},
    {"kind": "image_based", "feature": "points", "weight": 0.01},
]


@pytest.mark.parametrize(
    "law",
    [
        {"kind": "image_based", "feature": "moments", "interaction": "mean"},
        {"objectives": STACK},
    ],
    ids=["moments", "stack"],
)
def test_a_planned_path_is_tracked_by_other_features_than_points(law: dict[str, Any]) -> None:
    run = vg.run("gantry", images=False, law=law)
    assert run.outcome.kind is vg.OutcomeKind.REACHED, run.outcome


def test_a_feature_that_the_points_do_not_make_is_refused_before_anything_moves() -> None:
    law = {"kind": "image_based", "feature": "vanishing_point"}
    with pytest.raises(vg.InputError, match=r"law\.feature: given vanishing_point of .* points"):
        vg.run("gantry", images=False, law=law)
