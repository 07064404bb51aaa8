"""A copy that has states of its own, and shares what cannot change."""

from types import MappingProxyType

import numpy as np
import pytest

from vergence.arrays import frozen
from vergence.assembly.copied import copied


def test_a_copy_shares_read_only_arrays_and_functions_and_nothing_that_changes() -> None:
    fixed, changing = frozen([1.0, 2.0]), np.zeros(2)
    original = {"fixed": fixed, "changing": changing, "again": changing, "function": lambda x: x}
    copy = copied(original)
    assert copy["fixed"] is fixed
    assert copy["function"] is original["function"]
    assert copy["changing"] is not changing
    assert copy["changing"] is copy["again"]


def test_an_object_of_a_class_within_a_function_is_copied() -> None:
    """Such as a feature that a notebook makes: its module does not know the class by name."""

    class Counter:
        def __init__(self) -> None:
            self.counts = [1]

    original = {"object": Counter(), "class": Counter}
    copy = copied(original)
    assert copy["class"] is Counter
    assert type(copy["object"]) is Counter
    assert copy["object"].counts is not original["object"].counts


def test_a_read_only_mapping_is_copied() -> None:
    copy = copied(MappingProxyType({"a": [1]}))
    assert copy == {"a": [1]}
    with pytest.raises(TypeError):
        copy["a"] = 2


def test_what_cannot_be_copied_says_so() -> None:
    with pytest.raises(TypeError):
        copied(x for x in "ab")
