"""Laws that misbehave from some moment on, each in one way of its own."""

from collections.abc import Callable
from typing import Any, NamedTuple, NoReturn

import numpy as np

from vergence.arrays import FloatArray
from vergence.signals import JointCommand, JointState, Observation, OutcomeKind, Reference

K = OutcomeKind


class LawFault(NamedTuple):
    """One way in which a law may misbehave."""

    ends: frozenset[OutcomeKind]  # how a run with it may end
    answer: Callable[[FloatArray, np.random.Generator], Any]  # in place of its rates


class FaultyLaw:
    """Asks for the same rates at every image, until its fault sets in.

    Args:
        rates: (n,) rad/s or m/s.
        fault: which one; none if None.
        at: when it sets in, s.
        rng: draws what a fault leaves to chance.
    """

    def __init__(
        self,
        rates: FloatArray,
        fault: LawFault | None = None,
        at: float = 0.4,
        rng: np.random.Generator | None = None,
    ) -> None:
        self._rates, self._fault, self._at = rates, fault, at
        self._rng = rng or np.random.default_rng(0)

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return the rates, or what the fault makes of them."""
        rates = self._rates
        if self._fault is not None and joints.time >= self._at:
            rates = self._fault.answer(rates, self._rng)
        return JointCommand(rates, np.zeros(6))


def raising(error: BaseException) -> Callable[..., NoReturn]:
    """Return a function that raises an error, whatever it is given."""

    def fail(*_arguments: Any) -> NoReturn:
        raise error.with_traceback(None)  # that of the last time would be kept

    return fail


RAISED, COMMAND = frozenset({K.PART_RAISED}), frozenset({K.BAD_COMMAND})
LIMITED = frozenset({K.COMPLETED, K.JOINT_LIMIT, K.NOT_REACHED})
LAW_FAULTS = {
    "not numbers": LawFault(COMMAND, lambda v, _rng: np.full_like(v, np.nan)),
    "one not a number": LawFault(COMMAND, lambda v, _rng: np.array([*v[:-1], np.nan])),
    "infinite": LawFault(COMMAND, lambda v, _rng: np.full_like(v, np.inf)),
    "minus infinite": LawFault(COMMAND, lambda v, _rng: np.full_like(v, -np.inf)),
    "none": LawFault(COMMAND, lambda _v, _rng: np.zeros(0)),
    "one": LawFault(COMMAND, lambda _v, _rng: np.ones(1)),
    "too few": LawFault(COMMAND, lambda v, _rng: v[1:]),
    "too many": LawFault(COMMAND, lambda v, _rng: np.concatenate((v, v))),
    "a column": LawFault(COMMAND, lambda v, _rng: v[:, None]),
    "a row": LawFault(COMMAND, lambda v, _rng: v[None]),
    "a scalar": LawFault(COMMAND, lambda _v, _rng: np.float64(0.1)),
    "a list": LawFault(COMMAND, lambda v, _rng: v.tolist()),
    "a word": LawFault(COMMAND, lambda _v, _rng: "fast"),
    "None": LawFault(COMMAND, lambda _v, _rng: None),
    "objects": LawFault(COMMAND, lambda v, _rng: v.astype(object)),
    "complex": LawFault(COMMAND, lambda v, _rng: v + 1j),
    "truths": LawFault(COMMAND, lambda v, _rng: v > 0),
    "strings": LawFault(COMMAND, lambda v, _rng: v.astype(str)),
    "whole numbers": LawFault(LIMITED, lambda v, _rng: np.sign(v).astype(np.int64)),
    "single precision": LawFault(LIMITED, lambda v, _rng: v.astype(np.float32)),
    "read-only": LawFault(LIMITED, lambda v, _rng: np.broadcast_to(v[:1], v.shape)),
    "every other of an array": LawFault(LIMITED, lambda v, _rng: np.repeat(v, 2)[::2]),
    "backwards": LawFault(LIMITED, lambda v, _rng: v[::-1]),
    "huge": LawFault(LIMITED, lambda v, _rng: 1e300 * np.sign(v)),
    "beyond the limits": LawFault(LIMITED, lambda v, _rng: 100.0 * v),
    "tiny": LawFault(LIMITED, lambda v, _rng: 5e-324 * np.ones_like(v)),
    "to and fro": LawFault(LIMITED, lambda v, rng: rng.choice([-1e3, 1e3], len(v))),
    "random": LawFault(LIMITED, lambda v, rng: rng.normal(0, 10.0 ** rng.uniform(-3, 6), len(v))),
    "raises ValueError": LawFault(RAISED, raising(ValueError("singular"))),
    "raises ZeroDivisionError": LawFault(RAISED, raising(ZeroDivisionError("division by zero"))),
    "raises MemoryError": LawFault(RAISED, raising(MemoryError())),
    "raises StopIteration": LawFault(RAISED, raising(StopIteration())),
    "raises RecursionError": LawFault(RAISED, raising(RecursionError("too deep"))),
    "interrupts": LawFault(frozenset({K.STOPPED}), raising(KeyboardInterrupt())),
}
