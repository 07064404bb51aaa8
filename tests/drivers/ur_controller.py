"""A UR controller as a client sees it: dashboard, script port and RTDE v2.

It runs no URScript. It recognises the control program of ur_rtde and plays its registers: `speedj`,
`servoj`, stops and the watchdog. Words on standard input put it into other states; `tell` prints
what its joints did.

python ur_controller.py ADDRESS Q1,...,Q6
"""

import json
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

RATE_HZ, JOINTS = 500.0, 6
IDLE, TEACH, SPEEDJ, SERVOJ, WATCHDOG, END = 0, 0, 9, 11, 35, 255
STOPS = {12, 13, 15, 16, 17}
NO_REPLY = {6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71}  # in real time
FORMATS = {
    "DOUBLE": ">d", "INT32": ">i", "UINT32": ">I", "UINT64": ">Q", "BOOL": ">?", "UINT8": ">B",
    "VECTOR6D": ">6d", "VECTOR3D": ">3d", "VECTOR6INT32": ">6i",
}  # fmt: skip
TYPES = {
    "INT32": ("robot_mode", "safety_mode", "safety_status", "tool_output_voltage"),
    "UINT32": ("runtime_state", "robot_status_bits", "safety_status_bits", "speed_slider_mask"),
    "UINT64": ("actual_digital_input_bits", "actual_digital_output_bits"),
    "VECTOR6INT32": ("joint_mode",),
    "VECTOR3D": ("actual_tool_accelerometer", "payload_cog", "elbow_position", "elbow_velocity"),
    "DOUBLE": (
        "timestamp", "speed_scaling", "target_speed_fraction", "actual_momentum", "payload",
        "actual_main_voltage", "actual_robot_voltage", "actual_robot_current", "tcp_force_scalar",
        "standard_analog_input0", "standard_analog_input1", "standard_analog_output0",
        "standard_analog_output1", "actual_execution_time", "speed_slider_fraction",
        "standard_analog_output_0", "standard_analog_output_1",
    ),
    "UINT8": (
        "standard_digital_output_mask", "standard_digital_output", "standard_analog_output_mask",
        "configurable_digital_output_mask", "configurable_digital_output",
        "tool_digital_output_mask", "tool_digital_output", "standard_analog_output_type",
    ),
}  # fmt: skip
BY_NAME = {name: kind for kind, names in TYPES.items() for name in names}


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def kind_of(name: str) -> str:
    """The type of an RTDE variable."""
    for part, kind in (("_double_", "DOUBLE"), ("_int_", "INT32"), ("_bit_register_", "BOOL")):
        if part in name and "register" in name:
            return kind
    return BY_NAME.get(name, "VECTOR6D")


class Controller:
    """The arm, its program and its states, behind the four ports."""

    def __init__(self, start: list[float]) -> None:
        self.q, self.qd, self.time = list(start), [0.0] * JOINTS, 0.0
        self.mode, self.safety, self.remote, self.slider = 7, 1, True, 1.0
        self.version = "5.15"
        self.teach = self.frozen = self.running = False
        self.target: list[float] | None = None  # of `servoj`
        self.speed: list[float] | None = None  # of `speedj`
        self.acceleration, self.watchdog_s, self.heard = 1.4, 0.0, 0.0
        self.integers, self.doubles, self.state = [0] * 48, [0.0] * 48, 0
        self.fastest = self.hardest = 0.0  # rad/s, rad/s² that the joints were seen to move with
        self.owners: dict[str, Any] = {}  # the client that writes each input
        self.outputs = {"standard": 0, "configurable": 0, "tool": 0}  # bits
        self.lock, self.clients = threading.Lock(), []

    def tell(self) -> dict[str, object]:
        return {
            "q": self.q, "qd": self.qd, "fastest": self.fastest, "hardest": self.hardest,
            "running": self.running, "watchdog_s": self.watchdog_s, "outputs": self.outputs,
        }  # fmt: skip

    def value(self, name: str) -> Any:
        known = {
            "timestamp": self.time, "actual_q": self.q, "target_q": self.q, "actual_qd": self.qd,
            "target_qd": self.qd, "robot_mode": self.mode, "safety_mode": self.safety,
            "safety_status": self.safety, "runtime_state": 2 if self.running else 1,
            "robot_status_bits": 1 | self.running << 1 | self.teach << 2,
            "safety_status_bits": 1 if self.safety == 1 else 1 << (self.safety - 1),
            "speed_scaling": self.slider, "target_speed_fraction": self.slider,
        }  # fmt: skip
        return known.get(name, self.state if name == "output_int_register_0" else None)

    def obey(self) -> None:
        """Do what the input registers say, as the control program would."""
        self.heard = time.monotonic()
        if not self.running:
            return
        command, numbers = self.integers[0], self.doubles
        self.state = 1 if command == IDLE or command in NO_REPLY else 2
        if command == SERVOJ:
            self.target, self.speed = numbers[:JOINTS], None
        elif command == SPEEDJ:
            self.speed, self.target, self.acceleration = numbers[:6], None, numbers[6]
        elif command in STOPS:
            self.speed, self.target = [0.0] * JOINTS, None
        elif command == WATCHDOG:
            self.watchdog_s = 1.0 / numbers[0]
        elif command == END:
            self.end_program()

    def end_program(self) -> None:
        self.running, self.target, self.watchdog_s = False, None, 0.0
        self.speed, self.acceleration = [0.0] * JOINTS, 2.0

    def move(self, dt: float) -> None:
        """Advance by one period."""
        silent_s = time.monotonic() - self.heard
        if self.running and self.watchdog_s and silent_s > self.watchdog_s:
            self.end_program()
        if self.safety not in (1, 2) and self.running:
            self.end_program()
        desired = [0.0] * JOINTS
        if self.target is not None:
            desired = [(t - q) / 0.05 for t, q in zip(self.target, self.q, strict=True)]
        elif self.speed is not None:
            desired = [self.slider * v for v in self.speed]
        most = (1e3 if self.target is not None else self.acceleration) * dt
        change = [max(-most, min(most, v - w)) for v, w in zip(desired, self.qd, strict=True)]
        self.qd = [v + c for v, c in zip(self.qd, change, strict=True)]
        self.q = [q + dt * v for q, v in zip(self.q, self.qd, strict=True)]
        self.fastest = max(self.fastest, *map(abs, self.qd))
        self.hardest = max(self.hardest, *(abs(c) / dt for c in change))
        self.time += dt

    def live(self) -> None:
        due = time.monotonic()
        while True:
            due += 1.0 / RATE_HZ
            time.sleep(max(0.0, due - time.monotonic()))
            with self.lock:
                if not self.frozen:
                    self.move(1.0 / RATE_HZ)

    def set(self, word: str) -> None:
        """Change the state as somebody at the pendant would, or a cable."""
        name, _, value = word.partition(" ")
        with self.lock:
            if name == "protective":
                self.safety = 3
            elif name == "emergency":
                self.safety = 7
            elif name == "clear":
                self.safety = 1
            elif name == "mode":
                self.mode = int(value)
            elif name == "version":
                self.version = value
            elif name == "remote":
                self.remote = value == "on"
            elif name == "slider":
                self.slider = float(value)
            elif name == "teach":
                self.teach = value == "on"
            elif name == "freeze":
                self.frozen = True
            elif name == "cable":
                for client in self.clients:
                    client.shutdown(socket.SHUT_RDWR)
            elif name == "tell":
                say(json.dumps(self.tell()))
                return
        say("ok")


def dashboard(robot: Controller, client: socket.socket) -> None:
    client.sendall(b"Connected: Universal Robots Dashboard Server\n")
    modes = {7: "RUNNING", 5: "IDLE", 3: "POWER_OFF"}
    safety = {1: "NORMAL", 2: "REDUCED", 3: "PROTECTIVE_STOP", 7: "ROBOT_EMERGENCY_STOP"}
    for line in client.makefile("r"):
        answers = {
            "get serial number": "20235500001",
            "get robot model": "UR5",
            "programstate": "STOPPED",
            "polyscopeversion": f"URSoftware {robot.version}.0.126798 (Jan 01 2024)",
            "robotmode": f"Robotmode: {modes[robot.mode]}",
            "safetystatus": f"Safetystatus: {safety[robot.safety]}",
            "is in remote control": str(robot.remote).lower(),
            "running": f"Program running: {str(robot.running).lower()}",
        }
        client.sendall(f"{answers.get(line.strip().lower(), 'ok')}\n".encode())


def script(robot: Controller, client: socket.socket) -> None:
    text = b""
    while data := client.recv(1 << 16):
        text += data
        if b"def rtde_control" in text and text.rstrip().endswith(b"end"):
            with robot.lock:
                robot.running, robot.state, robot.integers[0] = True, 1, 0
                robot.heard = time.monotonic()
            text = b""


def sink(robot: Controller, client: socket.socket) -> None:
    while client.recv(1 << 16):
        pass


class Rtde:
    """One client of the real-time data exchange."""

    def __init__(self, robot: Controller, client: socket.socket) -> None:
        self.robot, self.client, self.lock = robot, client, threading.Lock()
        self.outputs: list[str] = []
        self.inputs: list[list[str]] = []
        self.rate_hz, self.going = RATE_HZ, threading.Event()
        robot.clients.append(client)

    def send(self, kind: str, payload: bytes) -> None:
        with self.lock:
            self.client.sendall(struct.pack(">HB", len(payload) + 3, ord(kind)) + payload)

    def publish(self) -> None:
        due = time.monotonic()
        try:
            while self.going.wait():
                with self.robot.lock:
                    values = [(kind_of(n), self.robot.value(n)) for n in self.outputs]
                self.send("U", b"\1" + b"".join(packed(*value) for value in values))
                due = max(due + 1.0 / self.rate_hz, time.monotonic() - 0.1)
                time.sleep(max(0.0, due - time.monotonic()))
        except OSError:
            pass

    def run(self) -> None:
        threading.Thread(target=self.publish, daemon=True).start()
        stream = self.client.makefile("rb")
        try:
            while head := stream.read(3):
                length, kind = struct.unpack(">HB", head)
                self.answer(chr(kind), stream.read(length - 3))
        finally:
            with self.robot.lock:
                mine = {name for name, owner in self.robot.owners.items() if owner is self}
                for name in mine:
                    del self.robot.owners[name]

    def answer(self, kind: str, payload: bytes) -> None:
        if kind == "V":
            self.send("V", b"\1")
        elif kind == "v":
            self.send("v", struct.pack(">IIII", 5, 15, 0, 0))
        elif kind == "O":
            (self.rate_hz,) = struct.unpack(">d", payload[:8])
            self.outputs = payload[8:].decode().split(",")
            self.send("O", b"\1" + ",".join(map(kind_of, self.outputs)).encode())
        elif kind == "I":
            names = [name for name in payload.decode().split(",") if name]
            with self.robot.lock:
                owners = [self.robot.owners.setdefault(name, self) for name in names]
            taken = any(owner is not self for owner in owners)
            self.inputs.append(names)
            kinds = ["IN_USE" if taken else kind_of(name) for name in names]
            number = 0 if taken else len(self.inputs)
            self.send("I", bytes([number]) + ",".join(kinds).encode())
        elif kind == "S":
            self.send("S", b"\1")
            self.going.set()
        elif kind == "P":
            self.going.clear()
            self.send("P", b"\1")
        elif kind == "U":
            self.take(self.inputs[payload[0] - 1], payload[1:])

    def take(self, names: list[str], payload: bytes) -> None:
        offset, written = 0, dict[str, int]()
        with self.robot.lock:
            for name in names:
                form = FORMATS[kind_of(name)]
                (value, *_) = struct.unpack_from(form, payload, offset)
                offset += struct.calcsize(form)
                if name.startswith("input_int"):
                    self.robot.integers[int(name.rpartition("_")[2])] = value
                elif name.startswith("input_double"):
                    self.robot.doubles[int(name.rpartition("_")[2])] = value
                else:
                    written[name] = value
            for kind, bits in self.robot.outputs.items():
                mask = written.get(f"{kind}_digital_output_mask", 0)
                fresh = written.get(f"{kind}_digital_output", 0)
                self.robot.outputs[kind] = bits & ~mask | fresh & mask
            if "input_int_register_0" in names:  # of the control program, which hears nothing else
                self.robot.obey()


def packed(kind: str, value: Any) -> bytes:
    form = FORMATS[kind]
    if value is None:
        return bytes(struct.calcsize(form))
    return struct.pack(form, *(value if isinstance(value, list) else [value]))


def serve(address: str, port: int, meet: Callable[[socket.socket], None]) -> None:
    listener = socket.create_server((address, port))

    def accept() -> None:
        while True:
            client, _ = listener.accept()
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=attend, args=(client,), daemon=True).start()

    def attend(client: socket.socket) -> None:
        with suppress(OSError):  # the client is gone
            meet(client)

    threading.Thread(target=accept, daemon=True).start()


if __name__ == "__main__":
    robot = Controller([float(q) for q in sys.argv[2].split(",")])
    serve(sys.argv[1], 29999, lambda client: dashboard(robot, client))
    serve(sys.argv[1], 30001, lambda client: sink(robot, client))
    serve(sys.argv[1], 30002, lambda client: script(robot, client))
    serve(sys.argv[1], 30003, lambda client: script(robot, client))
    serve(sys.argv[1], 30004, lambda client: Rtde(robot, client).run())
    threading.Thread(target=robot.live, daemon=True).start()
    say("ready")
    for words in sys.stdin:
        robot.set(words.strip())
