"""Simulated driver process of an arm, connected to the robot side's `RemoteArm`, in virtual time.

The connection has a delay in both directions, and the driver has a separate clock.
"""

from collections import deque
from typing import Any

import msgpack
import numpy as np

from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.driver_session import ArmShape

LIMITS = JointLimits(np.full(2, 2.0), np.full(2, 8.0))
SHAPE = ArmShape(("shoulder", "elbow"), ("finger",), np.array([0.04]), 0.08, LIMITS)
TICK_S = 0.001
AHEAD_S = 1000.0
"""Seconds by which the driver's clock is ahead of ours"""


class DriverDesk:
    """Connection to a driver, and a driver whose joints follow commanded velocities exactly."""

    def __init__(self, delay_s: float = 0.0, measuring_s: float = 0.0, period_s: float = 0.01) -> None:
        self.delay_s, self.measuring_s, self.period_s = delay_s, measuring_s, period_s
        self.now_s = 5.0
        self.notes: list[str] = []
        self.shown: list[ArmState] = []
        self.arm = RemoteArm(self, SHAPE, self.shown.append, self.notes.append)
        self.joints = np.zeros(2)
        self.velocities = np.zeros(2)
        self.refused: list[str] = []
        self.peer, self.sequence, self.speaks = b"driver", 0, True
        self.also: dict[str, Any] = {}
        self._sent_s = self._moved_s = 0.0
        self.newest: dict[str, Any] | None = None
        self._read_s = 0.0
        self._to_robot: deque[tuple[float, bytes, bytes]] = deque()
        self._to_driver: deque[tuple[float, dict[str, Any]]] = deque()

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        """Return what has arrived at the robot side; used by `RemoteArm` in place of a real port."""
        found = []
        while self._to_robot and self._to_robot[0][0] <= self.now_s:
            _, peer, payload = self._to_robot.popleft()
            found.append((peer, payload, self.now_s))
        return found

    def send(self, peer: bytes, payload: bytes) -> bool:
        """Send a message to the driver; used by `RemoteArm` in place of a real port."""
        self._to_driver.append((self.now_s + self.delay_s, msgpack.unpackb(payload)))
        return peer == self.peer

    @property
    def drivers_s(self) -> float:
        """Present time by the driver's clock, in seconds."""
        return self.now_s + AHEAD_S

    def say(self, peer: bytes | None = None, **fields: Any) -> None:
        """Send a state from the driver; `fields` replace its true values."""
        self.sequence += 1
        newest = self.newest
        state: dict[str, Any] = {
            "version": 1,
            "sequence": self.sequence,
            "sent_s": self.drivers_s,
            "measured_s": self.drivers_s - self.measuring_s,
            "echo_s": None if newest is None else newest["sent_s"],
            "held_s": 0.0 if newest is None else self.drivers_s - self._read_s,
            "joint_positions": self.joints.tolist(),
            "joint_velocities": self.velocities.tolist(),
        }
        payload = msgpack.packb(state | self.also | fields)
        self._to_robot.append((self.now_s + self.delay_s, peer or self.peer, payload))

    def drive(self) -> None:
        """Run the driver for one tick: receive, move the joints, and send a state if one is due."""
        while self._to_driver and self._to_driver[0][0] <= self.now_s:
            message = self._to_driver.popleft()[1]
            if "refused" in message:
                self.refused.append(message["refused"])
            else:
                self.newest, self._read_s = message, self.drivers_s
        valid = self.newest is not None and self.drivers_s < self.newest["valid_until_s"]
        self.velocities = np.array(self.newest["joint_velocities"]) if self.newest and valid else np.zeros(2)
        self.joints = self.joints + TICK_S * self.velocities
        if self.now_s - self._sent_s >= self.period_s - 1e-9:
            self._sent_s = self.now_s
            self.say()

    def run(self, seconds: float, velocity: float | None = None, gap_s: float = 0.1) -> None:
        """Run driver and robot side for `seconds`.

        velocity: commanded to both joints in each tick, and valid for `gap_s`; None: the arm is to stop.
        """
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            if self.speaks:
                self.drive()
            if not self.arm.begin(self.now_s):
                continue
            state = self.arm.state(self.now_s)
            told, until_s = (0.0, state.time_s) if velocity is None else (velocity, self.now_s + gap_s)
            self.arm.command(np.full(2, told), until_s)
            self.arm.command_gripper(0.0, until_s)

    def age_s(self) -> float:
        """Return the age that the robot side assumes for the newest state."""
        return self.now_s - self.arm.state(self.now_s).time_s
