"""A robot as it stands in the hall: a process of its own that is reached over a socket.

The arm is simulated; a real controller does the same things in the same order. Every period it
says where its joints are, takes the set-point that comes back, and hands it to its servos through
a watchdog. When nothing comes back any more, the watchdog brakes the arm.

Each message is one block of bytes. Robot: JSON with the time, joints and rates of every arm, and
the pictures that follow, each a block of its own. Client: JSON with the period it answers, and a
position and rate for every joint.
"""

import json
import sys
from multiprocessing.connection import Connection, Listener
from queue import SimpleQueue
from threading import Thread

import numpy as np

from vergence.cell import load_cell
from vergence.runtime import Driver
from vergence.runtime.hardware import Metronome, Watchdog
from vergence.signals import Sample, Setpoint
from vergence.simulation import SimulatedDriver


def serve(robot: Driver, listener: Listener, patience_s: float = 0.5) -> str:
    """Work for one client until it is gone and the arms are at rest; return why it ended."""
    dt, sample = 1.0 / robot.inner_rate_hz, robot.read()
    dogs = {
        name: Watchdog(arm, sample.joints[name].position, dt, patience_s)
        for name, arm in robot.arms.items()
    }
    with listener.accept() as link:
        outbox: SimpleQueue[list[bytes]] = SimpleQueue()
        Thread(target=send_all, args=(link, outbox), daemon=True).start()
        metronome, period, answered, gone = Metronome(robot.inner_rate_hz), 0, 0, ""
        while not gone or not all(dog.at_rest for dog in dogs.values()):
            if (period - answered) * dt <= patience_s:  # else it is busy: do not pile up the past
                outbox.put(blocks(period, sample))
            try:
                if not gone:
                    answered = max(answered, listen(link, period, metronome, dogs, dt))
            except (EOFError, OSError):
                gone = "the client is gone"
            if any(dog.tripped for dog in dogs.values()):
                gone = gone or f"the client was silent for {patience_s:g} s"
            robot.step({name: dog.step() for name, dog in dogs.items()})
            metronome.wait()
            sample, period = robot.read(), period + 1
        outbox.put([])
    return f"{gone}; the arm is at rest"


def blocks(period: int, sample: Sample) -> list[bytes]:
    """Return what there is to say: joints, and pictures."""
    joints = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in sample.joints.items()}
    pictures = [(f.camera, f.time, f.image) for f in sample.frames if f.image is not None]
    words = {
        "period": period,
        "time": sample.time,
        "joints": joints,
        "pictures": [(camera, time, image.shape) for camera, time, image in pictures],
    }
    return [json.dumps(words).encode(), *(image.tobytes() for _, _, image in pictures)]


def send_all(link: Connection, outbox: "SimpleQueue[list[bytes]]") -> None:
    """Send in a thread of its own: a client that does not read must not hold up the servo."""
    while message := outbox.get():
        try:
            for block in message:
                link.send_bytes(block)
        except OSError:
            return


def listen(
    link: Connection, period: int, metronome: Metronome, dogs: dict[str, Watchdog], dt: float
) -> int:
    """Hand set-points to the watchdogs until this period is answered or over; return the last."""
    answered = -1
    while answered < period and link.poll(metronome.left_s):
        words = json.loads(link.recv_bytes())
        answered = words["period"]
        for name, (position, velocity) in words["setpoints"].items():
            setpoint = Setpoint(np.array(position), np.array(velocity))
            dogs[name].hear(setpoint, age_s=dt * (period - answered))
    return answered


if __name__ == "__main__":
    cell, port = sys.argv[1], int(sys.argv[2])
    settings = dict(setting.split("=", 1) for setting in sys.argv[3:])
    robot = SimulatedDriver(load_cell(cell, settings))
    with Listener(("localhost", port)) as door:
        print("ready", flush=True)
        print(serve(robot, door))
    robot.close()
