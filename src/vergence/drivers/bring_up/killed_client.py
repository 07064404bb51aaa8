"""Whether an arm stops by itself when the program that moves it is killed."""

from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from time import monotonic, sleep

import numpy as np

from vergence.arrays import FloatArray
from vergence.drivers.bring_up.at_rest import NOISE
from vergence.drivers.bring_up.finding import Finding
from vergence.drivers.bring_up.watched import SlowMotion, watch
from vergence.errors import DriverSilent, VergenceError
from vergence.runtime.driver import Driver

_FARTHEST = 10.0  # nudges that the arm may be driven, if nobody kills the program
_STOPS_S = 1.0  # at the speed of the test: how far the arm may continue
_REST_S = 0.5  # in which it has to be at rest
_OPENS_S, _RECONNECTS_S, _AGAIN_S = 60.0, 15.0, 0.5

Opened = Callable[[], Driver]


def killed_client_finding(opened: Opened, arm: str, by: FloatArray) -> Finding:
    """Let another program move the arm slowly, kill it, and look where the arm is afterwards.

    No driver of this process may be connected meanwhile: a robot has one client.

    Args:
        opened: opens the driver; can be pickled.
        arm: name of the arm.
        by: how far each joint has moved when the program is killed, (n,), rad or m.
    """
    ours, theirs = get_context("spawn").Pipe(duplex=False)
    client = get_context("spawn").Process(
        target=_move_until_killed, args=(opened, arm, by, theirs), daemon=True
    )
    client.start()
    theirs.close()
    try:
        last, rate = _last_word(ours)
    except (EOFError, TimeoutError, VergenceError) as error:
        why = str(error) or "it did not move far enough"
        return _finding(np.nan, False, f"the second program could not move the arm: {why}")
    finally:
        client.kill()
        client.join()
        ours.close()
    driver = _reconnected(opened)
    if isinstance(driver, str):
        return _finding(np.nan, False, f"no connection afterwards: {driver}")
    try:
        seen = watch(driver, arm, 2.0 * _REST_S, lambda: driver.step({}))
    finally:
        driver.close()
    rests = np.ptp(seen.position[seen.time > seen.time[-1] - _REST_S], axis=0).max() <= NOISE
    return _judged(np.abs(seen.position[-1] - last), rate, bool(rests))


def _judged(travel: FloatArray, rate: FloatArray, rests: bool) -> Finding:
    """Judge how far the joints (n,) went on, at the rates (n,) of the test."""
    seconds = float((travel / np.maximum(rate, 1e-9)).max())
    if not rests:
        return _finding(seconds, False, "it still moves: give the robot a watchdog of its own")
    far = "it stopped late: shorten the robot's watchdog" if seconds > _STOPS_S else ""
    return _finding(seconds, not far, far)


def _finding(seconds: float, holds: bool, note: str) -> Finding:
    name = "motion after its program is killed, at the speed of the test"
    return Finding(name, seconds, "s", f"at most {_STOPS_S:g}, then at rest", holds, note)


def _last_word(ours: Connection) -> tuple[FloatArray, FloatArray]:
    """Return the joints when they have moved far enough, and the rates of the test, (n,) each."""
    end = monotonic() + _OPENS_S
    while monotonic() < end:
        if not ours.poll(1.0):
            continue
        said = ours.recv()
        if isinstance(said, VergenceError):
            raise said
        position, rate, far = said
        if far:
            return position, rate
    raise TimeoutError


def _reconnected(opened: Opened) -> Driver | str:
    """Open the driver as soon as the robot takes a new client; else return why it does not."""
    end, why = monotonic() + _RECONNECTS_S, ""
    while monotonic() < end:
        try:
            return opened()
        except VergenceError as error:
            why = str(error)
            sleep(_AGAIN_S)
    return why


def _move_until_killed(opened: Opened, arm: str, by: FloatArray, theirs: Connection) -> None:
    """Drive the joint with the most room away from its nearer limit, and send where the arm is."""
    try:
        _move(opened(), arm, by, theirs)
    except VergenceError as error:
        theirs.send(DriverSilent(str(error)))


def _move(driver: Driver, arm: str, by: FloatArray, theirs: Connection) -> None:
    model, motion = driver.arms[arm], SlowMotion(driver, arm)
    start = driver.read().joints[arm].position.copy()
    below, above = start - model.q_min, model.q_max - start
    joint = int(np.argmax(np.minimum(np.maximum(below, above), np.pi) / by))
    way = 1.0 if above[joint] > below[joint] else -1.0
    room = 0.5 * float(max(below[joint], above[joint]))
    goal = start[joint] + way * min(_FARTHEST * float(by[joint]), room)
    while abs(motion.setpoint[joint] - goal) > 1e-6:
        motion.toward(joint, goal)
        position = driver.read().joints[arm].position.copy()
        far = abs(position[joint] - start[joint]) >= by[joint]
        theirs.send((position, motion.rate_max, far))
    motion.hold()
    driver.close()
