"""Objectives that make no sense are refused before anything moves; what a stack leaves is said."""

import pytest

from vergence.assembly import run, run_cell
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.runtime import RunRecorder
from vergence.runtime.results import FREE_DIRECTIONS

ON_A_LINE = [[-0.03, 0.01, 0.0], [-0.03, 0.02, 0.0], [-0.03, 0.03, 0.0]]


def refusal(*objectives: dict, cell: str = "ur5", **changes: object) -> InputError:
    with pytest.raises(InputError) as caught:
        run(cell, images=False, law={"objectives": list(objectives)}, **changes)
    return caught.value


def image_based(feature: str, **settings: object) -> dict:
    return {"kind": "image_based", "feature": feature, **settings}


@pytest.mark.parametrize(
    ("feature", "desired", "said"),
    [
        ("lines", [[100, 100], [100, 100], [300, 200], [300, 200]], "ends of a segment"),
        ("moments", [[300, 200], [300, 240], [340, 240], [340, 200]], "alike"),
        ("polar_points", [[319.5, 239.5], [300, 240], [340, 240], [340, 200]], "image centre"),
        ("vanishing_point", [[200, 200], [300, 300], [200, 200], [300, 300]], "one line twice"),
    ],
)
def test_a_degenerate_desired_feature_is_refused_before_anything_moves(
    feature: str, desired: list[list[float]], said: str
) -> None:
    error = refusal(image_based(feature), task={"desired": desired})
    assert error.key == "law.objectives.0.feature"
    assert f"{feature} of" in str(error)
    assert said in str(error)
    assert "as desired" in str(error)


def test_the_only_objective_is_named_as_the_file_has_it() -> None:
    twice = {"desired": [[100, 100], [100, 100], [300, 200], [300, 200]]}
    with pytest.raises(InputError) as caught:
        run("ur5", images=False, law=image_based("lines"), task=twice)
    assert caught.value.key == "law.feature"


def test_points_on_a_line_have_no_pose() -> None:
    error = refusal(image_based("centre"), {"kind": "point_pose"}, target={"features": ON_A_LINE})
    assert error.key == "law.objectives.1.kind"
    assert "on one line" in str(error)
    error = refusal({"kind": "point_pose", "axes": ["rx"]}, target={"features": ON_A_LINE[:1]})
    assert "point_pose of 1 point" in str(error)


def test_a_posture_fits_the_arm_before_anything_moves() -> None:
    error = refusal(image_based("centre"), {"kind": "posture", "position": [0.0, 1.0]})
    assert (error.key, error.given) == ("law.objectives.1.position", "2 values")
    degrees = [0.0, -100.0, 100.0, -90.0, -90.0, 0.0]
    error = refusal(image_based("centre"), {"kind": "posture", "position": degrees})
    assert (error.key, error.given) == ("law.objectives.1.position.1", "-100")


def test_an_objective_names_a_camera_that_looks_at_something() -> None:
    error = refusal(image_based("centre"), image_based("size", camera="wrst"))
    assert (error.key, error.given) == ("law.objectives.1.camera", "wrst")
    assert "did you mean wrist" in error.allowed


def test_an_unknown_key_is_told_which_keys_stand_in_that_table() -> None:
    error = refusal(image_based("centre", wieght=2.0))
    assert "did you mean weight?" in error.allowed
    assert "limits" not in error.allowed
    with pytest.raises(InputError, match="limits"):
        load_cell("ur5", {"law.wieght": "2.0"})


def test_a_stack_of_two_cameras_says_what_it_leaves_free() -> None:
    def said(*objectives: dict) -> str:
        cell = load_cell("wrist_and_wall").replace(
            duration_s=0.1, law={"objectives": list(objectives)}
        )
        recorder = RunRecorder()
        events = run_cell(cell, (recorder,), images=False).events
        return next(
            (text for name, text in ((e.name, e.text) for e in events) if name == FREE_DIRECTIONS),
            "",
        )

    assert "free" in said(image_based("centre"), image_based("centre", camera="wall"))
    assert not said(image_based("points"), image_based("points", camera="wall"))


def test_a_kind_beside_objectives_is_pointed_into_them() -> None:
    with pytest.raises(InputError) as caught:
        run("ur5", images=False, law={"kind": "sum", "objectives": [{"kind": "image_based"}]})
    assert (caught.value.key, caught.value.given) == ("law.kind", "sum")
    assert caught.value.allowed.startswith("a kind in each objective; beside objectives: depth")
