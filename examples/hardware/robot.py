"""A robot as it stands in the hall: a process of its own that is reached over a socket.

The arm is simulated; a real controller does the same things in the same order. Every period it
says where its joints are, takes the set-point that comes back, and hands it to its servos through
a watchdog. When nothing usable comes back any more, the watchdog brakes the arm. The servo waits
for a client no longer than its period lasts, whatever the client does.

Messages are JSON, but for images (`link.py`). Client, first: its name. Robot: period, time, joints
and rates of every arm, and the images that follow, each a message of its own; or why it refuses.
Client: the period it answers, and a position and rate for every joint.
"""

import socket
import sys
from collections.abc import Mapping
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numpy as np
from clients import Clients
from link import Link, LinkBrokenError, decode, encode, vector

from vergence.cell import load_cell
from vergence.robot import Arm
from vergence.runtime import Driver
from vergence.runtime.hardware import Metronome, Watchdog
from vergence.signals import Sample, Setpoint
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
            outbox.put(messages(period, sample))
        try:
            if not gone:
                answered = max(answered, listen(link, period, metronome, robot.arms, dogs))
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


def messages(period: int, sample: Sample) -> list[bytes]:
    """Return what there is to say: joints, and images."""
    joints = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in sample.joints.items()}
    images = [(f.camera, f.time, f.image) for f in sample.frames if f.image is not None]
    words: dict[str, Any] = {
        "period": period,
        "time": sample.time,
        "joints": joints,
        "images": [(camera, time) for camera, time, _ in images],
    }
    return [encode(words), *(image.tobytes() for _, _, image in images)]


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
    arms: Mapping[str, Arm],
    dogs: Mapping[str, Watchdog],
) -> int:
    """Hand set-points to the watchdogs until this period is answered or over; return the last."""
    answered = -1
    while answered < period and (left_s := metronome.left_s) > 0.0:
        message = link.receive(left_s)
        if message is None:
            break
        answered, setpoints = read_answer(message, period, arms)
        for name, setpoint in setpoints.items():
            dogs[name].hear(setpoint, age_s=metronome.period_s * (period - answered))
    return answered


def read_answer(
    message: bytes, period: int, arms: Mapping[str, Arm]
) -> tuple[int, dict[str, Setpoint]]:
    """Return the period that a message answers, and its set-points."""
    words = decode(message)
    answered, told = words.get("period"), words.get("setpoints")
    if type(answered) is not int or not 0 <= answered <= period:
        raise LinkBrokenError("answers a period that has not been")
    if not isinstance(told, dict) or not told.keys() <= arms.keys():
        raise LinkBrokenError("sends set-points for arms that are not here")
    return answered, {name: read_setpoint(told[name], arms[name]) for name in told}


def read_setpoint(values: Any, arm: Arm) -> Setpoint:
    """Return the set-point that a client sent for an arm."""
    if not isinstance(values, list) or len(values) != 2:
        raise LinkBrokenError("sends something else than positions and rates")
    position, velocity = (np.array(vector(part, arm.joint_count)) for part in values)
    return Setpoint(position, velocity)


if __name__ == "__main__":
    cell, port = sys.argv[1], int(sys.argv[2])
    settings = dict(setting.split("=", 1) for setting in sys.argv[3:])
    robot = SimulatedDriver(load_cell(cell, settings))
    with socket.create_server(("localhost", port)) as listener:
        print("ready", flush=True)
        print(serve(robot, Clients(listener)))
    robot.close()
