"""What every Python peer shares: answer `CASE CALLS` lines, or print one JSON object."""

import gc
import json
import statistics
import sys
import time
from collections.abc import Callable, Mapping

Case = Callable[[], object]


def seconds_per_call(case: Case, calls: int) -> float:
    start = time.process_time()
    for _ in range(calls):
        case()
    return (time.process_time() - start) / calls


def serve(name: str, cases: Mapping[str, Case]) -> None:
    """Answer each line `CASE CALLS` with the seconds per call of that many calls."""
    print(name, flush=True)
    for line in sys.stdin:
        words = line.split()
        if len(words) != 2 or words[0] not in cases:
            print(f"error: no case {line.strip()}", flush=True)
        else:
            print(seconds_per_call(cases[words[0]], int(words[1])), flush=True)


def report(name: str, cases: Mapping[str, Case]) -> None:
    """Print microseconds per call (median and quartiles) of every case as one JSON object."""
    rows = {}
    for key, case in cases.items():
        seconds_per_call(case, 200)
        rounds = [1e6 * seconds_per_call(case, 100) for _ in range(31)]
        low, median, high = statistics.quantiles(rounds, n=4)
        rows[key] = {"median": median, "low": low, "high": high}
    print(json.dumps({"peer": name, "unit": "us", "cases": rows}))


def main(name: str, cases: Mapping[str, Case]) -> None:
    gc.disable()
    if sys.argv[1:] == ["serve"]:
        serve(name, cases)
    else:
        report(name, cases)
