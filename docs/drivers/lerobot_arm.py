"""Driver of an arm by LeRobot's `Robot` interface (0.4), for your own LeRobot environment with pyzmq and msgpack.

    from lerobot.robots.so_follower import SO101Follower, SOFollowerRobotConfig
    from lerobot_arm import drive

    config = SOFollowerRobotConfig(
        port="/dev/ttyACM0", id="mine", max_relative_target=5.0, disable_torque_on_disconnect=False
    )
    with SO101Follower(config) as robot:
        joints = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
        drive(robot, "tcp://127.0.0.1:5601", joints, gripper="gripper", opening_m=0.08)

The robot takes goals of joint positions in degrees (`use_degrees`), the gripper's from 0, closed, to 100. This driver
integrates velocities into goals, and holds the last goal from `valid_until_s` on. A goal leads a joint by at most
LEAD_RAD: the force on an obstacle does not grow further.
"""

import contextlib
import math
import time
from collections.abc import Sequence
from typing import Any

import msgpack
import zmq

LEAD_RAD = 0.1
"""Largest lead of a goal over its joint. A weak arm needs some: its motors' torque grows with the lead."""
LONGEST_TURN_S = 0.1
"""Longest time, in seconds, for which one turn moves the goals: a bus may hang."""
SMOOTHING_S = 0.05
"""Time constant, in seconds, of the velocities, which are filtered differences of positions."""
GRIPPER_PER_S = 150.0
"""Full speed of the gripper, in hundredths of the travel a second"""
HELD = 8.0
"""Distance from its goal, in hundredths, at which a closing gripper that stands holds something"""
STANDS = 0.5
"""Motion from one turn to the next, in hundredths, below which the gripper stands"""


class VelocityArm:
    """Velocity interface of a robot: goals from velocities, states from observations; times by one monotonic clock."""

    def __init__(
        self, robot: Any, joints: Sequence[str], gripper: str | None, opening_m: float, signs: Sequence[float] | None
    ) -> None:
        """joints (n,): LeRobot's names, in the model's order. signs (n,): -1 for a joint of opposite direction."""
        self._robot, self._joints, self._gripper, self._opening_m = robot, list(joints), gripper, opening_m
        self._signs = list(signs or [1.0] * len(self._joints))
        self._read_s = self._obeyed_s = -math.inf
        self._velocities = [0.0] * len(self._joints)
        self._positions = [0.0] * len(self._joints)
        self._open = self._goal_open = 100.0
        self._stood = 0
        self._closing = 0.0
        self._goals: list[float] = []
        self._command: dict[str, Any] | None = None

    def obey(self, command: dict[str, Any]) -> None:
        """Follow another command from now on."""
        self._command = command

    def measure(self, now_s: float) -> dict[str, Any]:
        """Read the arm; return the measured fields of a state."""
        seen = self._robot.get_observation()
        positions = [
            sign * math.radians(seen[f"{name}.pos"]) for name, sign in zip(self._joints, self._signs, strict=True)
        ]
        passed_s = now_s - self._read_s
        if math.isfinite(passed_s) and passed_s > 0.0:
            share = 1.0 - math.exp(-passed_s / SMOOTHING_S)
            self._velocities = [
                old + share * ((there - here) / passed_s - old)
                for old, here, there in zip(self._velocities, self._positions, positions, strict=True)
            ]
        self._positions, self._read_s = positions, now_s
        state: dict[str, Any] = {
            "measured_s": now_s,
            "joint_positions": positions,
            "joint_velocities": list(self._velocities),
        }
        if self._gripper is not None:
            was, self._open = self._open, min(max(float(seen[f"{self._gripper}.pos"]), 0.0), 100.0)
            # A gripper that closes on nothing also lags its goal, but moves.
            self._stood = self._stood + 1 if abs(was - self._open) < STANDS else 0
            state["opening_m"] = self._opening_m * self._open / 100.0
            state["holding"] = self._closing > 0.0 and self._open - self._goal_open > HELD and self._stood >= 3
        return state

    def move(self, now_s: float) -> None:
        """Advance the goals by the valid part of the command; send them."""
        command = self._command
        passed_s, self._obeyed_s = now_s - self._obeyed_s, now_s
        if not self._goals:
            self._goals, self._goal_open, passed_s = list(self._positions), self._open, 0.0
        if command is not None and math.isfinite(passed_s):
            # A command that expired since the last turn counts until then.
            valid_s = min(passed_s, LONGEST_TURN_S, max(command["valid_until_s"] - (now_s - passed_s), 0.0))
            self._goals = [
                min(max(goal + speed * valid_s, here - LEAD_RAD), here + LEAD_RAD) if speed else goal
                for goal, speed, here in zip(self._goals, command["joint_velocities"], self._positions, strict=True)
            ]
            # The grip lasts until the gripper is opened.
            self._closing = (valid_s > 0.0 and command["closing"]) or self._closing
            self._goal_open -= command["closing"] * GRIPPER_PER_S * valid_s
            self._goal_open = min(max(self._goal_open, self._open - 2.0 * HELD, 0.0), self._open + 2.0 * HELD, 100.0)
        goals = zip(self._joints, self._signs, self._goals, strict=True)
        action = {f"{name}.pos": math.degrees(sign * goal) for name, sign, goal in goals}
        if self._gripper is not None:
            action[f"{self._gripper}.pos"] = self._goal_open
        self._robot.send_action(action)


def drive(
    robot: Any,
    address: str,
    joints: Sequence[str],
    *,
    gripper: str | None = None,
    opening_m: float = 0.0,
    signs: Sequence[float] | None = None,
    rate_hz: float = 50.0,
) -> None:
    """Drive a connected robot until Ctrl-C; arguments as for VelocityArm. opening_m: free gap of the open gripper."""
    socket = zmq.Context().socket(zmq.DEALER)
    socket.setsockopt(zmq.SNDHWM, 2)
    socket.setsockopt(zmq.LINGER, 0)
    socket.connect(address)
    arm = VelocityArm(robot, joints, gripper, opening_m, signs)
    newest, read_s, sequence, next_s = None, 0.0, 0, time.monotonic()
    while True:
        try:
            state = arm.measure(time.monotonic())
        except ConnectionError as error:
            # A packet was lost on the bus: send no state; after 0.1 s without states the arm counts as lost.
            print("bus:", error, flush=True)
            time.sleep(1.0 / rate_hz)
            continue
        while socket.poll(0):  # read all, obey the newest
            message = msgpack.unpackb(socket.recv())
            if "refused" in message:
                print("refused:", message["refused"], flush=True)
            else:
                newest, read_s = message, time.monotonic()
                arm.obey(newest)
        with contextlib.suppress(ConnectionError):
            arm.move(time.monotonic())
        sequence, sent_s = sequence + 1, time.monotonic()
        state |= {"version": 1, "sequence": sequence, "sent_s": sent_s}
        if newest is not None:
            state |= {"echo_s": newest["sent_s"], "held_s": sent_s - read_s}
        with contextlib.suppress(zmq.Again):  # no robot side yet
            socket.send(msgpack.packb(state), zmq.NOBLOCK)
        next_s = max(next_s + 1.0 / rate_hz, sent_s)
        time.sleep(max(next_s - time.monotonic(), 0.0))
