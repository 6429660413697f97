"""Driver of an SO-101 by LeRobot's own `Robot` (0.6.1), in LeRobot's environment with pyzmq and msgpack.

Usage: python lerobot_arm.py /dev/ttyACM0 ID tcp://127.0.0.1:5601, with the ID of LeRobot's calibration.
"""

import math
import sys
import time
from typing import Any

import msgpack
import zmq

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")  # in the model's order
SCALES = dict.fromkeys(JOINTS, math.pi / 180.0) | {"gripper": 0.01}  # of LeRobot's degrees, and of 0, closed, to 100
OPENING_M, CLOSED_RAD, OPEN_RAD = 0.112, -0.174, 1.745  # gap of the open gripper; angles of its jaw in the model
LIMITS = {"velocity_rad_s": [1.0] * 5, "acceleration_rad_s2": [8.0] * 5, "latency_s": 0.07}  # assumed, not measured
LEAD, HELD = 0.1, 0.06  # lead of a goal, which bounds the force on an obstacle; lead of a jaw that holds something
CLOSING_PER_S, STANDS_PER_S, FILTER_S = 1.5, 0.1, 0.05  # gripper's full speed, and when it stands; time of velocities
GAP_S, GIVE_UP_S = 0.1, 3.0  # time without readings after which it is a fault, and after which the driver ends
FAULTS = {1: "voltage", 2: "encoder", 4: "temperature", 8: "current", 32: "overload"}  # bits of a servo's status
NOTHING = {"joint_velocities": [0.0] * 5, "closing": 0.0, "valid_until_s": -math.inf}  # command before the first


class Driver:
    """Arm's end of the port: goals move as told, whatever is read, wait for joints, stand from `valid_until_s` on."""

    def __init__(self, address: str) -> None:
        self._socket = zmq.Context().socket(zmq.DEALER)
        self._socket.sndhwm, self._socket.linger = 2, 0
        self._socket.connect(address)
        self._command, self._read_s, self._sequence, self._at_s = dict[str, Any](NOTHING), math.inf, 0, -math.inf
        self.here, self._goals, self._speeds = list[float](), list[float](), [0.0] * len(SCALES)

    def turn(self, seen: dict[str, Any], at_s: float, fault: str = "") -> dict[str, float]:
        """Take an observation that began at `at_s`, send the state, take the newest command; return the goals."""
        here, passed_s = [float(seen[f"{name}.pos"]) * scale for name, scale in SCALES.items()], at_s - self._at_s
        share, moves = -math.expm1(-passed_s / FILTER_S), zip(self._speeds, self.here or here, here, strict=True)
        self._speeds = [old + share * ((new - was) / passed_s - old) for old, was, new in moves]
        self._at_s, self.here, self._goals = at_s, here, self._goals or here
        self.send(fault)
        valid_s = max(min(self._command["valid_until_s"] - at_s + passed_s, passed_s), 0.0) if passed_s < GAP_S else 0.0
        told = *self._command["joint_velocities"], -CLOSING_PER_S * self._command["closing"]
        ways = [(goal, goal + speed * valid_s, at) for goal, speed, at in zip(self._goals, told, here, strict=True)]
        self._goals = [new if abs(new - at) < max(LEAD, abs(old - at)) else old for old, new, at in ways]
        return {f"{name}.pos": goal / scale for (name, scale), goal in zip(SCALES.items(), self._goals, strict=True)}

    def send(self, fault: str = "") -> None:
        """Send the newest observation as the arm's state, with a fault in words if there is one; take commands."""
        while self._socket.poll(0):
            message = msgpack.unpackb(self._socket.recv())
            if "refused" in message:
                print("refused:", message["refused"], flush=True)
            else:
                self._command, self._read_s = message, time.monotonic()
        (*joints, jaw), self._sequence, sent_s = self.here, self._sequence + 1, time.monotonic()
        state = {"version": 1, "sequence": self._sequence, "sent_s": sent_s, "measured_s": self._at_s, "limits": LIMITS}
        state |= {"echo_s": self._command.get("sent_s"), "held_s": max(sent_s - self._read_s, 0.0)}
        state |= {"joint_positions": joints, "joint_velocities": self._speeds[:-1]}
        state |= {"opening_m": OPENING_M * jaw, "finger_positions": [CLOSED_RAD + (OPEN_RAD - CLOSED_RAD) * jaw]}
        state |= {"holding": jaw > HELD and jaw - self._goals[-1] > HELD and abs(self._speeds[-1]) < STANDS_PER_S}
        state |= {"condition": "fault" if fault else "ready", "condition_text": fault[:200]}
        if self._socket.poll(0, zmq.POLLOUT):  # else there is no robot side yet
            self._socket.send(msgpack.packb(state))


def drive(robot: Any, address: str, rate_hz: float = 50.0) -> None:
    """Drive a connected robot until Ctrl-C; SystemExit with one line if its bus is dead for GIVE_UP_S."""
    driver, good_s = Driver(address), time.monotonic()
    while True:
        began_s = time.monotonic()
        try:
            seen, status = robot.get_observation(), robot.bus.sync_read("Status", normalize=False).items()
            faults = [f"{name}: {word}" for name, bits in status for bit, word in FAULTS.items() if bits & bit]
            robot.send_action(driver.turn(seen, began_s, ", ".join(faults)))
            good_s = began_s
        except Exception as error:  # the libraries of a bus raise many kinds
            dead_s, why = time.monotonic() - good_s, f"servo bus: {str(error).strip().partition(chr(10))[0]}"
            if dead_s > GIVE_UP_S:
                raise SystemExit(f"{why} (for {dead_s:.1f} s; check its power and its plugs)") from None
            if dead_s > GAP_S and driver.here:
                driver.send(why)
        time.sleep(max(began_s + 1.0 / rate_hz - time.monotonic(), 0.0))


if __name__ == "__main__":
    try:
        from lerobot.robots.so_follower import SO101Follower, SOFollowerRobotConfig

        port, name, address = sys.argv[1:]
        with SO101Follower(SOFollowerRobotConfig(port, False, id=name, use_degrees=True)) as arm:
            drive(arm, address)
    except (ImportError, OSError, ValueError, zmq.ZMQError) as error:
        print(
            f"{' '.join(str(error).split())}; valid: /dev/ttyACM0 ID tcp://127.0.0.1:5601, in LeRobot's environment",
            file=sys.stderr,
        )
        sys.exit(2)
