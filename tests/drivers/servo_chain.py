"""STS3215 servos on a serial bus, behind a pty. Words on standard input change them.

python servo_chain.py TICK1,...,TICKN
"""

import json
import math
import os
import pty
import struct
import sys
import threading
import time
import tty

PING, READ, WRITE, SYNC_READ, SYNC_WRITE = 1, 2, 3, 0x82, 0x83
MODEL, TORQUE, GOAL, POSITION, SPEED, TEMPERATURE, FAULT = 3, 40, 42, 56, 58, 63, 65
LAG_S = 0.05  # of a servo behind its goal


def say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


class Chain:
    """The servos' memories, and how they move."""

    def __init__(self, ticks: list[int]) -> None:
        self.near, far = pty.openpty()
        tty.setraw(self.near)
        tty.setraw(far)
        self.port, self.far = os.ttyname(far), far
        self.silent: set[int] = set()
        self.place = {i + 1: float(tick) for i, tick in enumerate(ticks)}
        self.memory = {i: bytearray(128) for i in self.place}
        self.time, self.writes = time.monotonic(), 0
        for i, memory in self.memory.items():
            struct.pack_into("<H", memory, MODEL, 777)
            struct.pack_into("<H", memory, GOAL, int(self.place[i]))
            memory[TEMPERATURE] = 31

    def move(self) -> None:
        now = time.monotonic()
        dt, self.time = now - self.time, now
        for i, memory in self.memory.items():
            (goal,) = struct.unpack_from("<H", memory, GOAL)
            gap = (goal - self.place[i]) * memory[TORQUE]
            self.place[i] += gap * (1.0 - math.exp(-dt / LAG_S))
            speed = round(abs(gap) * math.exp(-dt / LAG_S) / LAG_S)
            struct.pack_into("<H", memory, POSITION, round(self.place[i]))
            struct.pack_into("<H", memory, SPEED, speed | (gap < 0) << 15)

    def serve(self) -> None:
        data = b""
        while True:
            data += os.read(self.near, 4096)
            while (start := data.find(b"\xff\xff")) >= 0 and len(data) >= start + 4:
                number, length = data[start + 2], data[start + 3]
                end = start + 4 + length
                if len(data) < end:
                    break
                packet, data = data[start + 4 : end], data[end:]
                self.move()
                if answer := self.answer(number, packet[0], packet[1:-1]):
                    os.write(self.near, answer)

    def answer(self, number: int, instruction: int, given: bytes) -> bytes:
        if instruction == SYNC_WRITE:
            address, length = given[0], given[1]
            self.writes += 1
            for k in range(2, len(given), length + 1):
                self.memory[given[k]][address : address + length] = given[k + 1 : k + 1 + length]
            return b""
        if instruction == SYNC_READ:
            address, length = given[0], given[1]
            return b"".join(self.reply(i, self.memory[i][address:][:length]) for i in given[2:])
        if number not in self.memory:
            return b""
        if instruction == READ:
            return self.reply(number, self.memory[number][given[0] :][: given[1]])
        if instruction == WRITE:
            self.memory[number][given[0] : given[0] + len(given) - 1] = given[1:]
        return self.reply(number)

    def reply(self, number: int, data: bytes = b"") -> bytes:
        if number in self.silent:
            return b""
        body = bytes([number, len(data) + 2, 0]) + data
        return b"\xff\xff" + body + bytes([~sum(body) & 255])

    def set(self, words: str) -> None:
        name, _, value = words.partition(" ")
        if name == "silent":
            self.silent.add(int(value))
        elif name == "fault":
            self.memory[int(value)][FAULT] = 32  # overload
        elif name == "well":
            self.memory[int(value)][FAULT] = 0
        elif name == "hot":
            self.memory[int(value)][TEMPERATURE] = 80
        elif name == "other":
            struct.pack_into("<H", self.memory[int(value)], MODEL, 1284)
        elif name == "unplug":
            os.close(self.far)
            os.close(self.near)
        if name == "tell":
            self.move()
            torque = [memory[TORQUE] for memory in self.memory.values()]
            told = {"ticks": list(self.place.values()), "torque": torque, "writes": self.writes}
            say(json.dumps(told))
        else:
            say("ok")


if __name__ == "__main__":
    chain = Chain([int(tick) for tick in sys.argv[1].split(",")])
    threading.Thread(target=chain.serve, daemon=True).start()
    say(chain.port)
    for line in sys.stdin:
        chain.set(line.strip())
