"""A robot in a process of its own that is reached over a socket.

The arm is simulated; a real controller does the same in the same order. Every period it says where
its joints are, hands the set-point that comes back to its servos through a watchdog, which brakes
the arm when none comes, and sets outputs, such as a gripper. It waits for no client beyond that.
"""

import socket
import sys
from collections.abc import Mapping
from queue import SimpleQueue
from threading import Thread

from clients import Clients

from vergence.cell import load_cell
from vergence.drivers.socket_robot import (
    Link,
    LinkBrokenError,
    encode,
    read_answer,
    said_by_robot,
)
from vergence.runtime import Driver, HasOutputs, outputs_of
from vergence.runtime.hardware import Metronome, Watchdog
from vergence.simulation import SimulatedDriver


def serve(robot: Driver, clients: Clients, timeout_s: float = 0.5) -> str:
    """Work for one client until it is gone and the arms are at rest; return why it ended."""
    dt, sample = 1.0 / robot.inner_rate_hz, robot.read()
    dogs = {
        name: Watchdog(arm, sample.joints[name].position, dt, timeout_s)
        for name, arm in robot.arms.items()
    }
    client, link = clients.wait()
    outbox: SimpleQueue[list[bytes]] = SimpleQueue()
    Thread(target=send_all, args=(link, outbox, timeout_s), daemon=True).start()
    metronome, period, answered, gone = Metronome(robot.inner_rate_hz), 0, 0, ""
    while not gone or not all(dog.at_rest for dog in dogs.values()):
        if not gone and (period - answered) * dt <= timeout_s:  # else it is busy: do not pile up
            outbox.put(said_by_robot(period, sample, outputs_of(robot)))
        try:
            if not gone:
                answered = max(answered, listen(link, period, metronome, robot, dogs))
        except LinkBrokenError as error:
            gone = f"{client} {error}"
            outbox.put([encode({"refused": gone})])
        if any(dog.tripped for dog in dogs.values()):
            gone = gone or f"{client} was silent for {timeout_s:g} s"
        robot.step({name: dog.step() for name, dog in dogs.items()})
        metronome.wait()
        sample, period = robot.read(), period + 1
    outbox.put([])
    clients.dismiss()
    return f"{gone}; the arm is at rest"


def send_all(link: Link, outbox: "SimpleQueue[list[bytes]]", timeout_s: float) -> None:
    """Send in a thread of its own: a client that does not read must not hold up the servo."""
    try:
        while message := outbox.get():
            link.send(message, timeout_s)
    except LinkBrokenError:
        pass  # the watchdog notices
    finally:
        link.close()


def listen(
    link: Link,
    period: int,
    metronome: Metronome,
    robot: Driver,
    dogs: Mapping[str, Watchdog],
) -> int:
    """Hand set-points to the watchdogs until this period is answered or over; return the last."""
    answered = -1
    while answered < period and (left_s := metronome.left_s) > 0.0:
        message = link.receive(left_s)
        if message is None:
            break
        answer = read_answer(message, period, robot.arms, outputs_of(robot))
        answered = answer.period
        for name, setpoint in answer.setpoints.items():
            dogs[name].hear(setpoint, age_s=metronome.period_s * (period - answered))
        if isinstance(robot, HasOutputs):
            for name, value in answer.outputs.items():
                robot.set_output(name, value)
    return answered


if __name__ == "__main__":
    cell, port = sys.argv[1], int(sys.argv[2])
    settings = dict(setting.split("=", 1) for setting in sys.argv[3:])
    robot = SimulatedDriver(load_cell(cell, settings))
    with socket.create_server(("localhost", port)) as listener:
        print("ready", flush=True)
        print(serve(robot, Clients(listener)))
    robot.close()
