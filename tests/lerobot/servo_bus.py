"""Emulated bus of STS3215 servos, an SO-101's, on a pseudo terminal: Feetech's own SDK talks to it as to the real one.

A servo follows its goal while its torque is on, and holds the goal for ever: so does a real one whose host dies.
Nothing stands in its way, and nothing weighs on it.
"""

import math
import os
import select
import threading
import tty
from collections.abc import Sequence
from typing import Final, Self

from common.clock import MonotonicClock

SERVOS: Final = 6
STEPS: Final = 4096
CENTRE: Final = 2047.5
"""Steps of a turn, and the reading that LeRobot calls 0° if the calibrated range is the whole turn"""
STEP_RAD: Final = 2.0 * math.pi / STEPS
_TOP_STEPS_S: Final = 3072.0
"""Greatest speed of a servo: 45 turns a minute"""
_LAG_S: Final = 0.05
"""Time constant with which a servo follows its goal, as assumed here"""
_STEP_S: Final = 0.002
_LATE_S: Final = 0.045
"""Time, in s, after which this thread answers no more, as the answer would be taken for that of the next question"""
_MODEL: Final = 777
_EVERYBODY: Final = 0xFE
_PING, _READ, _WRITE, _SYNC_READ, _SYNC_WRITE = 1, 2, 3, 0x82, 0x83
_TORQUE, _GOAL, _POSITION, STATUS = 40, 42, 56, 65
"""Addresses in a servo's table of registers"""


class Servo:
    """One servo: its table of registers, and the shaft."""

    def __init__(self, number: int, position: float) -> None:
        """number: its address on the bus. position: in steps."""
        self.table = bytearray(256)
        self.table[0:6] = bytes((3, 10, 0, _MODEL & 0xFF, _MODEL >> 8, number))
        self.limit(0, STEPS - 1)
        self.position = position
        self.turn(0.0)

    @property
    def goal(self) -> int:
        """Goal in steps."""
        return int.from_bytes(self.table[_GOAL : _GOAL + 2], "little")

    def limit(self, least: int, most: int) -> None:
        """Write the ends of the range, in steps, as calibrating does."""
        self._put(9, least)
        self._put(11, most)

    def turn(self, passed_s: float) -> None:
        """Turn the shaft for a short time towards the goal."""
        if self.table[_TORQUE]:
            wanted = (self.goal - self.position) * (1.0 - math.exp(-passed_s / _LAG_S))
            most = _TOP_STEPS_S * passed_s
            self.position += min(max(wanted, -most), most)
        self._put(_POSITION, round(self.position))

    def write(self, at: int, data: bytes) -> None:
        """Write registers; a torque that is switched on holds the present position."""
        if at == _TORQUE and data[0] and not self.table[_TORQUE]:
            self.table[_GOAL : _GOAL + 2] = self.table[_POSITION : _POSITION + 2]
        self.table[at : at + len(data)] = data

    def _put(self, at: int, value: int) -> None:
        self.table[at : at + 2] = value.to_bytes(2, "little")


class Servos:
    """All servos of a bus, without I/O: bytes in, bytes out."""

    def __init__(self, positions: Sequence[float]) -> None:
        """positions: of the servos 1, 2 and so on, in steps."""
        self.by_number = {number: Servo(number, where) for number, where in enumerate(positions, start=1)}
        self.commanded: list[list[int]] = []
        """Goals of all servos, in steps, after each packet that wrote goals"""
        self._pending = b""

    def turn(self, passed_s: float) -> None:
        """Turn all shafts."""
        for servo in self.by_number.values():
            servo.turn(passed_s)

    def hear(self, data: bytes) -> bytes:
        """Take bytes from the host; return the servos' answers to all packets that are complete now."""
        self._pending += data
        said = b""
        while (start := self._pending.find(b"\xff\xff")) >= 0 and len(self._pending) > start + 3:
            end = start + 4 + self._pending[start + 3]
            if len(self._pending) < end:
                break
            packet, self._pending = self._pending[start + 2 : end], self._pending[end:]
            if _checksum(packet[:-1]) == packet[-1]:
                said += self._obey(packet[0], packet[2], packet[3:-1])
        return said

    def _obey(self, number: int, code: int, rest: bytes) -> bytes:
        if code == _SYNC_READ:
            asked = (self.by_number.get(one) for one in rest[2:])
            return b"".join(_answer(one, one.table[rest[0] : rest[0] + rest[1]]) for one in asked if one)
        if code == _SYNC_WRITE:
            for at in range(2, len(rest), rest[1] + 1):
                if (one := self.by_number.get(rest[at])) is not None:
                    one.write(rest[0], rest[at + 1 : at + 1 + rest[1]])
            if rest[0] == _GOAL:
                self.commanded.append([one.goal for one in self.by_number.values()])
            return b""
        called = list(self.by_number.values()) if number == _EVERYBODY else [self.by_number.get(number)]
        said = b""
        for servo in called:
            if servo is not None and code == _PING:
                said += _answer(servo, b"")
            elif servo is not None and code == _READ:
                said += _answer(servo, servo.table[rest[0] : rest[0] + rest[1]])
            elif servo is not None and code == _WRITE:
                servo.write(rest[0], rest[1:])
                said += _answer(servo, b"")
        return said


def _answer(servo: Servo, data: bytes | bytearray) -> bytes:
    body = bytes((servo.table[5], len(data) + 2, servo.table[STATUS])) + data
    return b"\xff\xff" + body + bytes((_checksum(body),))


def _checksum(body: bytes) -> int:
    return ~sum(body) & 0xFF


class ServoBus:
    """Bus on a pseudo terminal, in a thread, as a context."""

    def __init__(self, start_rad: Sequence[float]) -> None:
        """start_rad: where the servos stand, from their centres."""
        self.servos = Servos([CENTRE + angle / STEP_RAD for angle in start_rad])
        self.history: list[tuple[float, list[float]]] = []
        """Times, in s, and positions of all servos, in rad from their centres, every 2 ms"""
        self._host, self._device = os.openpty()
        tty.setraw(self._host)
        tty.setraw(self._device)
        self.port = os.ttyname(self._device)
        """Path of the serial port"""
        self._clock = MonotonicClock()
        self._deaf_until_s = -math.inf
        self._unplugged = False
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join()
        os.close(self._device)
        if not self._unplugged:
            os.close(self._host)

    def be_deaf(self, for_s: float) -> None:
        """Hear and answer nothing from now on for a time: a loose plug, a dropped supply."""
        self._deaf_until_s = self._clock.now() + for_s

    def unplug(self) -> None:
        """Let the port itself fail for good, as when the cable to the computer is pulled."""
        self._unplugged = True

    @property
    def dead(self) -> bool:
        """Whether the bus is dead for good"""
        return self._unplugged or self._deaf_until_s == math.inf

    def _serve(self) -> None:
        before_s = self._clock.now()
        while not self._ends.is_set():
            there = [] if self._unplugged else select.select([self._host], [], [], _STEP_S)[0]
            now_s = self._clock.now()
            self.servos.turn(now_s - before_s)
            late, before_s = now_s - before_s > _LATE_S, now_s
            positions = [(one.position - CENTRE) * STEP_RAD for one in self.servos.by_number.values()]
            self.history.append((now_s, positions))
            if self._unplugged:
                self._close()
                self._ends.wait(_STEP_S)
            elif there:
                data = os.read(self._host, 4096)
                if now_s >= self._deaf_until_s and not late:
                    os.write(self._host, self.servos.hear(data))

    def _close(self) -> None:
        if self._host >= 0:
            os.close(self._host)
            self._host = -1
