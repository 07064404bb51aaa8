"""The benchmarks' harness says what it measured, and never hides a peer that is missing."""

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path

import pytest

from baseline import UnusableBaseline, beside, read_baseline
from harness import Block, Missing, Peer, compare, measured, row


def taking(*microseconds: float) -> Block:
    """A block that pretends to take these times, one a round."""
    times = cycle(microseconds)
    return lambda count: 1e-6 * next(times)


KEYS = (
    *("name", "value", "low", "high", "unit", "peer", "peer_value"),
    *("ratio", "ratio_low", "ratio_high", "aim", "holds"),
)


@pytest.mark.parametrize(
    ("ours", "peers", "expected"), [(1.0, 10.0, True), (2.0, 10.0, False), (1.5, 10.0, True)]
)
def test_a_ratio_holds_at_most_at_its_aim(ours: float, peers: float, expected: bool) -> None:
    peer = Peer("other", taking(peers))
    result = row("case", taking(ours), peer, ratio_aim=0.15 + 1e-12, rounds=3, round_seconds=1e-5)
    assert tuple(result) == KEYS
    assert result["ratio"] == pytest.approx(ours / peers)
    assert result["ratio_low"] == result["ratio_high"] == pytest.approx(ours / peers)
    assert result["peer_value"] == pytest.approx(peers)
    assert result["holds"] is expected


def test_a_missing_peer_is_named_and_its_aim_stays_open() -> None:
    peer = Missing("ViSP", "install it so")
    result = row("case", taking(1.0), peer, ratio_aim=0.15, rounds=3, round_seconds=1e-5)
    assert result["peer"] == "ViSP: peer not installed (install it so)"
    assert (result["peer_value"], result["ratio"], result["holds"]) == (None, None, None)


def test_a_value_out_of_its_aim_fails_though_the_peer_is_missing() -> None:
    peer = Missing("ViSP", "install it so")
    result = row("case", taking(5.0), peer, ratio_aim=0.1, value_aim=4.0, rounds=3)
    assert result["holds"] is False


@pytest.mark.parametrize(
    ("value", "aim", "expected"), [(3.5, 3, True), (2, 3, False), (1, None, None)]
)
def test_a_figure_measured_elsewhere_makes_the_same_row(
    value: float, aim: float | None, expected: bool | None
) -> None:
    result = measured("loop", value, "x real time", at_least=aim)
    assert tuple(result) == KEYS
    assert result["holds"] is expected


def test_rounds_take_turns() -> None:
    order: list[str] = []

    def noting(name: str) -> Block:
        def block(count: int) -> float:
            order.append(name)
            return 1.0

        return block

    timings = compare({"a": noting("a"), "b": noting("b")}, rounds=3)
    tail: Sequence[str] = order[-6:]
    assert tail == ["a", "b", "a", "b", "a", "b"]
    assert timings["a"].median == 1.0
    assert timings["a"].quartiles == (1.0, 1.0)


def test_a_row_is_put_beside_an_earlier_one() -> None:
    peer = Peer("other", taking(10.0))
    before = [row("tick", taking(4.0), peer, rounds=3), row("alone", taking(2.0), rounds=3)]
    slower = Peer("other", taking(20.0))
    now = [row("tick", taking(6.0), slower, rounds=3), row("alone", taking(3.0), rounds=3)]
    tick, alone, new = beside([*now, row("new", taking(1.0), rounds=3)], before)
    assert tick["change"] == pytest.approx(0.75)  # the machine is slower, we are faster on it
    assert (tick["before"], alone["before"]) == (pytest.approx(4.0), pytest.approx(2.0))
    assert alone["change"] == pytest.approx(1.5)
    assert (new["before"], new["change"]) == (None, None)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"benchmarks": [3]}'])
def test_a_baseline_that_is_none_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "baseline.json"
    path.write_text(text)
    with pytest.raises(UnusableBaseline, match="vergence bench --json"):
        read_baseline(path)
