"""A robot of Franka: franky-sim, with the stops of a real one, in real time if the computer can.

python franka_robot.py ADDRESS Q1,…,Q7: started by the test. The simulator has no reflexes, so every
commanded velocity is noted; "tell" says how fast, how hard and how jerkily the arm was driven. Its
clock waits for the client's answers, so a busy computer is slower but loses no state.
"""

import json
import select
import sys
import threading
import time
from typing import Any

import numpy as np
from franky_sim import SimulationServer, simulation_server
from franky_sim.franka_robot_protocol import (
    BaseCommand,
    MoveStatus,
    RobotCommand,
    RobotMode,
    UDPCommand,
)
from franky_sim.franka_robot_server import FrankaRobotServer
from franky_sim.mujoco_simulator import MujocoSimulator

PERIOD, ANSWER_S = 0.001, 0.5
MODES = {
    "well": None,
    "reflex": RobotMode.kReflex,
    "user": RobotMode.kUserStopped,
    "guiding": RobotMode.kGuiding,
    "locked": RobotMode.kOther,
}


class Watched(FrankaRobotServer):
    """Notes what is commanded, and can be stopped."""

    made: "Watched"
    steps = 0

    def __init__(self, *arguments: Any) -> None:
        Watched.made = self
        self.mode: RobotMode | None = None
        self.last: tuple[int, Any, Any] | None = None  # message, velocity, acceleration
        self.clear()
        super().__init__(*arguments)

    def clear(self) -> None:
        self.fastest = self.hardest = self.jerkiest = np.zeros(7)

    def _handle_udp_command(self, command_data: bytes) -> None:
        command = UDPCommand.from_bytes(command_data)
        if command.message_id > 0 and self.mode is None:
            self.note(command.message_id, np.array(command.dq_c))
        super()._handle_udp_command(command_data)

    def note(self, message: int, velocity: Any) -> None:
        """Take a commanded velocity; it answers a state, so states that got lost count."""
        last, self.last = self.last, (message, velocity, np.zeros(7))
        if last is None or message <= last[0]:
            return
        dt = PERIOD * (message - last[0])
        acceleration = (velocity - last[1]) / dt
        self.last = message, velocity, acceleration
        self.fastest = np.maximum(self.fastest, np.abs(velocity))
        self.hardest = np.maximum(self.hardest, np.abs(acceleration))
        self.jerkiest = np.maximum(self.jerkiest, np.abs(acceleration - last[2]) / dt)

    def wait(self) -> None:
        """Wait for the answer to the last state, if a motion is under way."""
        connection = self._FrankaServer__udp_socket
        if connection is not None and self.current_motion_id:
            select.select([connection], [], [], ANSWER_S)

    def stop(self, mode: RobotMode | None) -> None:
        self.mode = mode
        if mode is not None and self.current_motion_id:
            number = self.current_motion_id
            self.stop_motion(send_preemption_signal=False)
            reply = RobotCommand.kMove, number, MoveStatus.kReflexAborted
            BaseCommand.send_response(self._tcp_socket, *reply)
            self.reset_current_motion_id()

    @property
    def robot_state(self) -> Any:
        """The state with the mode, and the acceleration as commanded: the simulator smooths it."""
        state = super().robot_state
        if self.last is not None and self.current_motion_id:
            state = state.replace(ddq_d=tuple(self.last[2]))
        return state if self.mode is None else state.replace(robot_mode=self.mode)


def listen(words: list[str]) -> None:
    words.extend(line.strip() for line in iter(sys.stdin.readline, ""))


def obey(robot: Watched, word: str) -> str:
    if word == "tell":
        state = robot.robot_state
        told = {
            "time": [PERIOD * Watched.steps],
            "q": state.q,
            "qd": state.dq,
            "qd_d": state.dq_d,
            "mode": state.robot_mode.name,
        }
        told |= {"fingers": [robot.robot.hand_width]}
        told |= {name: getattr(robot, name).tolist() for name in ("fastest", "hardest", "jerkiest")}
        return json.dumps({k: v if isinstance(v, str) else list(v) for k, v in told.items()})
    if word == "cable":
        robot.reset_state()
    elif word == "clear":
        robot.clear()
    else:
        robot.stop(MODES[word])
    return "ok"


def track_positions(robot: Any) -> None:
    """Let the simulator follow the integral of commanded velocities, as a real robot does.

    By itself it only damps the difference of velocities, so friction holds slow joints.
    """
    target, seen = np.zeros(7), -2

    def follow(velocity: Any) -> None:
        nonlocal target, seen
        if Watched.steps > seen + 1:
            target = np.array(robot.state.q)
        seen = Watched.steps
        target = target + PERIOD * velocity
        robot._joint_position_control(target + np.array(robot.kv) / np.array(robot.kp) * velocity)

    robot._joint_velocity_control = follow


def main(address: str, start: list[float]) -> None:
    simulation_server.FrankaRobotServer = Watched
    words: list[str] = []
    threading.Thread(target=listen, args=(words,), daemon=True).start()
    with MujocoSimulator(enable_visualization=False) as simulator:
        track_positions(simulator.add_robot(initial_q=start))
        with SimulationServer(simulator, hostname_candidates=[address]) as server:
            say("ready")
            due = time.monotonic()
            while True:
                while words:
                    say(obey(Watched.made, words.pop(0)))
                server.run_once(realtime=False)
                Watched.steps += 1
                Watched.made.wait()
                due = max(due + PERIOD, time.monotonic() - 1.0)
                time.sleep(max(0.0, due - time.monotonic()))


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1], [float(q) for q in sys.argv[2].split(",")])
