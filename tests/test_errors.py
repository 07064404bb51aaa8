"""Messages about names: what a user needs of those that there are."""

from vergence.errors import MOST_NAMES, nearest


def test_few_names_are_all_told_in_order_with_the_one_probably_meant() -> None:
    assert (
        nearest("flang", ["tool", "flange", "base"]) == "base, flange, tool (did you mean flange?)"
    )
    assert nearest("x", []) == "none"


def test_of_many_names_those_most_like_the_given_one_are_told_and_the_others_counted() -> None:
    names = [f"finger_{k:02d}" for k in range(90)] + ["wrist_left", "wrist_right"]
    told = nearest("wrist_lft", names)
    assert told.startswith("wrist_left, wrist_right, finger_")
    assert told.endswith(f" and {len(names) - MOST_NAMES} more (did you mean wrist_left?)")
    assert told.count(", ") == MOST_NAMES - 1
    assert nearest("", names).startswith("finger_00, finger_01, ")
