"""Servo the robot behind the socket: everything but the driver is as in simulation.

python robot.py puma560 5007 &
python servo.py puma560 5007
"""

import sys
from pathlib import Path

from vergence.cell import load_cell
from vergence.control import OptimalTracking, PseudoInverse, Servo
from vergence.drivers import Equipment
from vergence.drivers.socket_robot import SocketRobot
from vergence.errors import VergenceError
from vergence.estimation import TrackedPoints
from vergence.planning import FixedReference
from vergence.runtime import Driver, Loop, Recorder, RunInfo
from vergence.signals import Outcome, Reference
from vergence.simulation import SimulatedDriver
from vergence.vision import SsdTracker, pick_features


def servo(driver: Driver, model: SimulatedDriver, duration_s: float, folder: Path) -> Outcome:
    """Keep four points of the first image where they are; leave a recording."""
    sample = driver.read()
    while not sample.frames:  # the first image may be late
        driver.step({})
        sample = driver.read()
    image = sample.frames[0].image
    points = pick_features(image, 4).points_px
    law = Servo(
        model.world.arm_to_camera("wrist"),
        driver.cameras["wrist"],
        OptimalTracking(axes=("x", "y", "rx", "ry")),
        solver=PseudoInverse(),
        depth_m=1.0,
    )
    seen = TrackedPoints("wrist", SsdTracker(image, points))
    goal = FixedReference(Reference(0.0, points))
    recorder = Recorder(folder)
    recorder.begin(RunInfo.of(driver, "robot over a socket", "", None, "wrist"))
    loop = Loop(driver, "puma", seen, goal, law, outer_rate_hz=30, listeners=[recorder])
    outcome = loop.run(duration_s)
    recorder.close(outcome, {})
    return outcome


def main(cell: str, port: int) -> None:
    model = SimulatedDriver(load_cell(cell))
    # What runs for the first time is compiled; a rehearsal spares the robot the wait.
    servo(model, model, 0.2, Path("runs/rehearsal"))
    equipment = Equipment(cell, model.arms, model.cameras, model.inner_rate_hz)
    driver = SocketRobot(f"localhost:{port}").open(equipment)
    folder = Path("runs/robot-over-a-socket")
    print(servo(driver, model, 5.0, folder))
    print(f"see it by: vergence report {folder}")
    driver.close()


if __name__ == "__main__":
    try:
        main(sys.argv[1], int(sys.argv[2]))
    except VergenceError as error:
        raise SystemExit(str(error)) from None
