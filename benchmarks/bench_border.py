"""What the supervision of the loop costs in a tick: the checks of a sample, and following."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from harness import Block, row
from vergence.robot import Arm, Chain
from vergence.runtime import FollowingBound
from vergence.runtime.border import Border
from vergence.runtime.following import Follower
from vergence.signals import JointState, Sample

JOINTS, RATE_HZ = 6, 500.0


def six_joints() -> Arm:
    chain = Chain(
        np.tile(np.eye(3), (JOINTS + 1, 1, 1)), np.zeros((JOINTS + 1, 3)), np.zeros(JOINTS, bool)
    )
    one = np.ones(JOINTS)
    names = tuple(f"joint{i + 1}" for i in range(JOINTS))
    return Arm(names, chain, -3 * one, 3 * one, 2 * one, 8 * one)


class Still:
    """A driver that only says what there is."""

    arms, cameras, inner_rate_hz = {"arm": six_joints()}, {}, RATE_HZ


def ticks(tick: Callable[[Border, Follower, Sample], None], begin: float) -> Block:
    """A block of ticks of an arm that stands, by CPU time; the samples are made before."""

    def block(count: int) -> float:
        q, rest = np.zeros(JOINTS), np.zeros(JOINTS)
        samples = []
        for number in range(count + 1):
            now = begin + number / RATE_HZ
            samples.append(Sample(now, {"arm": JointState(now, q, rest)}, ()))
        border = Border(Still(), lambda: False, 0.5)
        follower = Follower(Still.arms["arm"], "arm", q, 1.0 / RATE_HZ, FollowingBound(), 1.0)
        tick(border, follower, samples[0])
        start = time.process_time()
        for sample in samples[1:]:
            tick(border, follower, sample)
        return (time.process_time() - start) / count

    return block


def check(border: Border, _follower: Follower, sample: Sample) -> None:
    border.admit(sample)


def check_and_follow(border: Border, follower: Follower, sample: Sample) -> None:
    border.admit(sample)
    follower.observe(border.time, sample.joints["arm"].position, None)


def run() -> list[dict[str, Any]]:
    return [
        row("border: checks of a sample, six joints", ticks(check, 1e6), value_aim=3.0),
        row("border: checks and following, six joints", ticks(check_and_follow, 1e6)),
    ]
