"""Features by name in a cell: they arrive, stacked too, and what does not fit is refused."""

from typing import Any

import pytest

import vergence as vg
from vergence.experiments import Ending

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


ELSEWHERE = [[300, 290], [330, 260], [350, 330], [320, 340]]  # px, in no view of the board


@pytest.mark.parametrize("feature", ["centre", "size", "orientation"])
def test_a_law_that_leaves_points_free_is_judged_by_its_feature(feature: str) -> None:
    run = vg.run(
        "ur5",
        images=False,
        law={"kind": "image_based", "feature": feature, "gain": 2.0},
        target={"motion": {"kind": "stationary"}},
        task={"desired": ELSEWHERE, "until": {"kind": "reached"}},
    )
    assert run.outcome.kind is vg.OutcomeKind.REACHED, run.outcome
    assert run.summary["final_error_px"] < 1.0
    assert run.summary["max_error_px"] > 50.0
    first, last = (next(e for e in run.arms["ur5"].errors[::step] if e) for step in (1, -1))
    assert {name.partition(".")[0] for name in last} == {feature}
    assert all(abs(error) < 0.01 * max(map(abs, first.values())) for error in last.values())


def test_comparisons_count_such_a_law_as_converged() -> None:
    law = {"kind": "image_based", "feature": "size", "gain": 2.0}
    still = vg.load_cell("ur5").replace(
        law=law, duration_s=4.0, target={"motion": {"kind": "stationary"}}
    )
    (score,) = vg.compare(still, ["own"], starts=4, seed=2).scores
    assert score.count(Ending.CONVERGED) == score.trials == 4
