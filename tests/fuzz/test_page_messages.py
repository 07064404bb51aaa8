"""Whatever a page sends is a command, or is refused in one short sentence."""

import json

from hypothesis import given
from hypothesis import strategies as st
from untrusted import ends_well, mutants

from vergence.app.watch.commands import Seek, SetSpeed, TurnKnob, parse

GOOD = (
    {"do": "speed", "value": 0.5},
    {"do": "seek", "value": 3},
    {"do": "law", "name": "constrained"},
    {"do": "knob", "key": "gain", "value": 2.5},
    {"do": "grab", "view": "wrist", "u": 12.5, "v": -3},
    {"do": "move", "view": "", "u": 0.5, "v": 0.25, "along": True},
)
WORDS = ("do", "value", "view", "u", "v", "along", "key", "name", "speed", "knob", "grab", "let go")
NESTED = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.sampled_from(WORDS),
    lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(WORDS) | st.text(), inner),
)


def read(message: str | bytes) -> None:
    command = parse(message)
    if isinstance(command, SetSpeed):
        assert 0.01 <= command.value <= 1000
    if isinstance(command, Seek):
        assert 0 <= command.value <= 1e9
    if isinstance(command, TurnKnob):
        json.dumps(command.value, allow_nan=False)


@given(st.sampled_from(GOOD).flatmap(lambda good: mutants(json.dumps(good).encode())))
def test_a_mutant_of_a_command(message: bytes) -> None:
    ends_well(lambda: read(message))


@given(NESTED)
def test_any_json(values: object) -> None:
    ends_well(lambda: read(json.dumps(values)))


@given(st.text() | st.binary())
def test_any_text(message: str | bytes) -> None:
    ends_well(lambda: read(message))
