"""No set-point of a run among obstacles touches anything; without law and guard many do."""

import re

from vergence.experiments.workers import Workers
from vergence.signals import OutcomeKind
from vergence.studies.guarantees.collisions import LAWS, collisions_check, try_obstacles


def test_runs_among_obstacles_touch_nothing_and_would_without_the_clearance():
    runs = [try_obstacles(1, index) for index in range(20)]
    assert {run.law for run in runs} == set(LAWS)
    assert min(run.least_m for run in runs) > 0.0
    assert any(run.kind is OutcomeKind.COLLISION for run in runs if run.law == "plain")
    hit = [try_obstacles(1, index, guarded=False).least_m <= 0.0 for index in range(8)]
    assert sum(hit) >= 4


def test_the_check_counts_and_tells_the_runs_of_each_law():
    check = collisions_check(8, 2, Workers(1), lambda done: None)
    assert (check.measured, check.holds) == (0, True)
    assert check.others is not None
    braked = dict(check.others.results)
    assert set(braked) == set(LAWS)
    assert re.fullmatch(r"\d of \d, \d+\.\d mm", braked["plain"])
