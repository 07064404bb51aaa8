"""Times us and our peers, round by round in turn, so that a busy machine slows both alike.

Seconds are CPU seconds, of all threads of a process: what others do meanwhile does not count.

A *block* runs a case a number of times and says the seconds per call: `calls(f)` makes one of a
Python function, `loops(f)` of a function that repeats inside itself (a compiled loop), and
`peers.py` hands out blocks of programs that run beside us. `compare` interleaves blocks and
`row` makes one line of the table of them.
"""

import gc
import os
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Block = Callable[[int], float]
"""Runs a case this many times; returns the seconds per call."""

UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6}


@dataclass(frozen=True)
class Timing:
    """What one case took, a figure for each round."""

    seconds: tuple[float, ...]  # per call, one entry a round

    @property
    def median(self) -> float:
        return statistics.median(self.seconds)

    @property
    def quartiles(self) -> tuple[float, float]:
        return quartiles(self.seconds)


def quartiles(figures: Sequence[float]) -> tuple[float, float]:
    if len(figures) < 2:
        return figures[0], figures[0]
    low, _, high = statistics.quantiles(figures, n=4, method="inclusive")
    return low, high


@dataclass(frozen=True)
class Missing:
    """A peer that is not on this machine, and how to get it."""

    name: str
    advice: str


@dataclass(frozen=True)
class Peer:
    """A peer's case that can be timed."""

    name: str
    block: Block


def calls(function: Callable[[], object]) -> Block:
    """A block of a Python function; what a call from Python costs is part of the figure."""

    def block(count: int) -> float:
        start = time.process_time()
        for _ in range(count):
            function()
        return (time.process_time() - start) / count

    return block


def loops(function: Callable[[int], object]) -> Block:
    """A block of a function that itself repeats its case, such as a loop inside a kernel."""

    def block(count: int) -> float:
        start = time.process_time()
        function(count)
        return (time.process_time() - start) / count

    return block


def calls_a_round(block: Block, round_seconds: float) -> int:
    """How many calls take about so long; compiles and warms the caches on the way."""
    block(1)
    count = 1
    while (once := block(count)) * count < 0.2 * round_seconds and count < 1_000_000:
        count *= 2
    return max(1, int(round_seconds / once))


def compare(
    blocks: Mapping[str, Block], rounds: int = 31, round_seconds: float = 0.01
) -> dict[str, Timing]:
    """Times blocks in turn: each round runs every block once, for about `round_seconds`."""
    counts = {name: calls_a_round(block, round_seconds) for name, block in blocks.items()}
    seconds: dict[str, list[float]] = {name: [] for name in blocks}
    collecting = gc.isenabled()
    gc.disable()
    try:
        for _ in range(rounds):
            for name, block in blocks.items():
                seconds[name].append(block(counts[name]))
    finally:
        if collecting:
            gc.enable()
    return {name: Timing(tuple(values)) for name, values in seconds.items()}


def busy_ticks() -> dict[int, int]:
    """How long each core has worked since the machine started, as the kernel counts."""
    lines = Path("/proc/stat").read_text().splitlines()
    cores = [line.split() for line in lines if line.startswith("cpu") and line[3].isdigit()]
    idle = (4, 5)  # columns: waiting for work, waiting for a disk
    return {
        int(words[0][3:]): sum(int(word) for i, word in enumerate(words) if i and i not in idle)
        for words in cores
    }


def idlest_core() -> int:
    """The core of ours that worked least for a moment."""
    before = busy_ticks()
    time.sleep(0.1)
    after = busy_ticks()
    return min(os.sched_getaffinity(0), key=lambda core: after[core] - before[core])


@contextmanager
def on_one_core(one_core: bool) -> Iterator[None]:
    """Keeps this thread on one idle core meanwhile, if desired; peer programs follow it there.

    Cores differ in speed on a busy machine, so a ratio is fair only on one.
    """
    before = os.sched_getaffinity(0)
    if one_core:
        os.sched_setaffinity(0, {idlest_core()})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def row(
    name: str,
    ours: Block,
    peer: Peer | Missing | None = None,
    *,
    unit: str = "us",
    ratio_aim: float | None = None,
    value_aim: float | None = None,
    rounds: int = 31,
    round_seconds: float = 0.01,
    one_core: bool = True,
) -> dict[str, Any]:
    """Times one case, with its peer in turn where there is one, and says whether its aim holds.

    Args:
        name: what is timed.
        ours: our block.
        peer: the peer's; `Missing` leaves its figures empty and says so.
        unit: `s`, `ms` or `us`.
        ratio_aim: ours over the peer's is at most this.
        value_aim: ours is at most this, in `unit`.
        rounds: how many rounds.
        round_seconds: about how long a block runs a round.
        one_core: whether both sides share one core, as is fair where each uses one thread.

    Returns:
        A row with the keys `name`, `value`, `low`, `high` (quartiles), `unit`, `peer`,
        `peer_value`, `ratio` (median of the rounds' ratios), `ratio_low`, `ratio_high` (their
        quartiles), `aim` (words) and `holds` (None without an aim, or when the peer that the aim
        names is missing).
    """
    blocks = {"ours": ours}
    if isinstance(peer, Peer):
        blocks["peer"] = peer.block
    with on_one_core(one_core):
        timings = compare(blocks, rounds, round_seconds)
    scale = UNITS[unit]
    low, high = timings["ours"].quartiles
    value = scale * timings["ours"].median
    peer_value = ratio = ratio_low = ratio_high = None
    if "peer" in timings:
        peer_value = scale * timings["peer"].median
        pairs = zip(timings["ours"].seconds, timings["peer"].seconds, strict=True)
        ratios = [own / other for own, other in pairs]
        ratio, (ratio_low, ratio_high) = statistics.median(ratios), quartiles(ratios)
    return {
        "name": name,
        "value": value,
        "low": scale * low,
        "high": scale * high,
        "unit": unit,
        "peer": peer_words(peer),
        "peer_value": peer_value,
        "ratio": ratio,
        "ratio_low": ratio_low,
        "ratio_high": ratio_high,
        "aim": aim_words(ratio_aim, value_aim, unit),
        "holds": holds([(ratio, ratio_aim), (value, value_aim)]),
    }


def measured(
    name: str,
    value: float,
    unit: str,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
) -> dict[str, Any]:
    """A row of a figure that was measured elsewhere, such as a factor of real time."""
    aim, aimed = None, holds([(value, at_most)])
    if at_most is not None:
        aim = aim_words(None, at_most, unit)
    if at_least is not None:
        aim, aimed = f"at least {at_least:g} {unit}".rstrip(), value >= at_least
    return {
        "name": name,
        "value": value,
        "low": None,
        "high": None,
        "unit": unit,
        "peer": None,
        "peer_value": None,
        "ratio": None,
        "ratio_low": None,
        "ratio_high": None,
        "aim": aim,
        "holds": aimed,
    }


def peer_words(peer: Peer | Missing | None) -> str | None:
    if isinstance(peer, Missing):
        return f"{peer.name}: peer not installed ({peer.advice})"
    return None if peer is None else peer.name


def aim_words(ratio_aim: float | None, value_aim: float | None, unit: str) -> str | None:
    words = []
    if ratio_aim is not None:
        words.append(f"ratio at most {ratio_aim:g}")
    if value_aim is not None:
        words.append(f"at most {value_aim:g} {unit}")
    return " and ".join(words) or None


def holds(figures: Sequence[tuple[float | None, float | None]]) -> bool | None:
    """Whether every (figure, aim) with an aim holds; None where one cannot be said, or none is."""
    aimed = [(figure, aim) for figure, aim in figures if aim is not None]
    if any(figure is not None and figure > aim for figure, aim in aimed):
        return False
    if not aimed or any(figure is None for figure, _ in aimed):
        return None
    return True
