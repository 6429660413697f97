"""Driver of a Universal Robots arm in remote control by ur_rtde 1.6, in an environment with pyzmq and msgpack.

Usage: python ur_arm.py MODEL ADDRESS-OF-THE-ROBOT [NAME=VALUE ...]. Names: address, acceleration_rad_s2, latency_s,
watchdog_hz, gripper (2f85: Robotiq's, by its URCap). Ends with 2: wrong words; 3: no connection; 4: the arm cannot be
driven; 5: the connection is lost. ur_rtde's script repeats a speed without end, whatever `time` it has: the watchdog
of the arm's controller ends it, in a protective stop, if this process dies.
"""

import contextlib
import math
import os
import signal
import socket as sockets
import sys
import threading
import time
from typing import TextIO

import msgpack
import zmq
from dashboard_client import DashboardClient
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

PERIOD_S, DRIFT_S, STALE_S, LOST_S, ENDED_S = 0.008, 1e-5, 0.1, 1.0, 0.5
LIGHT, HEAVY = [180] * 3 + [360] * 3, [120, 120, 150, 210, 210, 210]  # degrees a second, by UR's user manuals
FASTEST = {"ur3": LIGHT, "ur3e": LIGHT, "ur5": [180] * 6, "ur5e": [180] * 6, "ur20": HEAVY, "ur30": HEAVY}
FASTEST |= dict.fromkeys(("ur10", "ur10e", "ur12e", "ur16e"), [120] * 2 + [180] * 4)
SAFETY = {1: "ready", 2: "ready", 3: "protective_stop", 5: "protective_stop", 6: "emergency_stop", 7: "emergency_stop"}
RUNNING, PLAYING = 7, 2
WIDEST_M, LEAD, GRIP = 0.085, 40, "SPE 60 FOR 60 GTO 1"  # the gripper counts from 0, open, to 255
SAYS = ["timestamp", "actual_q", "actual_qd", "robot_mode", "safety_mode", "runtime_state"]
SAID = {"address": "tcp://127.0.0.1:5601", "acceleration_rad_s2": "3", "latency_s": "0.03", "watchdog_hz": "20"}


def end(code: int, why: object) -> None:
    """End at once with one line, whatever ur_rtde's threads wait for."""
    print("ur:", " ".join(str(why).split()), file=sys.stderr, flush=True)
    os._exit(code)


def ask(robot: str, stop: bool) -> str:
    """Return the controller's words for its modes; end its program before, which may only pause."""
    panel = DashboardClient(robot)
    panel.connect()
    with contextlib.suppress(RuntimeError):  # nothing runs
        if stop:
            panel.stop()
    return f"{panel.safetymode()}, {panel.robotmode()}"


def lose(robot: str, why: object) -> None:
    """End the driver, and the program if it can be reached: ur_rtde may have begun it anew, without a watchdog."""
    with contextlib.suppress(RuntimeError):
        ask(robot, stop=True)
    end(5, f"{robot}: the connection is lost: {why}")


def tell(line: TextIO, words: str) -> str:
    """Return the gripper's answer."""
    print(words, file=line, flush=True)
    return line.readline()


class Driver:
    """Arm's end of the port."""

    def __init__(self, model: str, robot: str, said: dict[str, str]) -> None:
        self.robot, self.watchdog_hz, self.sequence = robot, float(said["watchdog_hz"]), 0
        self.socket, self.most_rad_s2 = zmq.Context().socket(zmq.DEALER), float(said["acceleration_rad_s2"])
        self.socket.sndhwm, self.socket.linger = 2, 0  # old states are useless
        self.socket.connect(said["address"])
        self.limits = {"velocity_rad_s": [math.radians(one) for one in FASTEST[model]]}
        self.limits |= {"acceleration_rad_s2": [self.most_rad_s2] * 6, "latency_s": float(said["latency_s"])}
        self.newest = {"sent_s": None, "joint_velocities": [0.0] * 6, "closing": 0.0, "valid_until_s": -math.inf}
        self.control, self.driven, self.told, self.words, self.gripper = None, False, (), "", {}
        self.stamp_s, self.least_s, self.read_s = 0.0, math.inf, time.monotonic()
        try:
            self.seen = RTDEReceiveInterface(robot, -1.0, SAYS)
        except RuntimeError as error:
            end(3, f"{robot}: no connection: {error}")
        self.fresh_s, self.ended_s = time.monotonic(), math.inf
        for serve in (self.guard, self.serve_gripper) if said.get("gripper") else (self.guard,):
            threading.Thread(target=serve, daemon=True).start()

    def guard(self) -> None:
        """End the driver when no data has come for LOST_S, also while ur_rtde waits for its connection."""
        silent_s = 0.0
        while silent_s < LOST_S:  # counted by steps: this process may have been stopped
            fresh_s = self.fresh_s
            time.sleep(0.05)
            silent_s = silent_s + 0.05 if self.fresh_s == fresh_s < math.inf else 0.0
        lose(self.robot, f"no data for {LOST_S:g} s")

    def serve_gripper(self) -> None:
        """Move the gripper, each goal LEAD counts ahead of where it is."""
        while True:
            moved, self.gripper = 0.0, {}
            with contextlib.suppress(OSError, ValueError), sockets.create_connection((self.robot, 63352), 1.0) as one:
                line = one.makefile("rw")
                while True:
                    holds, at, newest = tell(line, "GET OBJ") == "OBJ 2\n", int(tell(line, "GET POS")[4:]), self.newest
                    self.gripper = {"opening_m": (1.0 - at / 255.0) * WIDEST_M, "holding": holds}
                    closing = newest["closing"] if time.monotonic() < newest["valid_until_s"] else 0.0
                    if closing or (moved and not holds):  # what is held stays held
                        tell(line, f"SET POS {min(max(at + round(LEAD * closing), 0), 255)} {GRIP}")
                    moved = closing
                    time.sleep(0.03)
            time.sleep(1.0)

    def turn(self) -> None:
        """Obey the newest command, and send a state."""
        while self.socket.poll(0):
            message = msgpack.unpackb(self.socket.recv())
            if "refused" in message:
                print("refused:", message["refused"], flush=True)
            else:
                self.newest, self.read_s = message, time.monotonic()
        now_s, was_s, self.stamp_s = time.monotonic(), self.stamp_s, self.seen.getTimestamp()
        if self.stamp_s != was_s:
            self.fresh_s, self.least_s = now_s, min(self.least_s + DRIFT_S, now_s - self.stamp_s)
        modes = self.seen.getSafetyMode(), self.seen.getRobotMode()
        condition = SAFETY.get(modes[0], "fault")
        condition = "fault" if condition == "ready" and modes[1] != RUNNING else condition
        if modes != self.told:
            self.told, self.words = modes, "" if condition == "ready" else ask(self.robot, self.driven)
            print("ur:", self.words or "ready", flush=True)
        if condition == "fault" and self.control is None:
            end(4, f"{self.robot}: cannot be driven: {self.words}; valid: powered on, brakes released, normal")
        if condition != "ready":
            self.driven, self.ended_s = False, math.inf
        elif now_s - self.ended_s > ENDED_S:  # and no stop explains it
            end(4, f"{self.robot}: the control program has ended: at the pendant, or by a broken connection")
        elif self.driven and self.seen.getRuntimeState() != PLAYING:  # ur_rtde may begin it anew, without a watchdog
            self.driven, self.ended_s = False, now_s
            ask(self.robot, stop=True)
        elif self.driven:
            self.obey(now_s)
        elif self.ended_s == math.inf:
            self.begin()
        if self.stamp_s != was_s:
            self.send(condition)

    def begin(self) -> None:
        """Begin ur_rtde's program, with a watchdog."""
        self.control, self.fresh_s = None, math.inf  # the registers are free then
        try:
            self.control = RTDEControlInterface(self.robot)
        except RuntimeError as error:
            end(4, f"{self.robot}: cannot be driven: {error}")
        self.fresh_s = began_s = time.monotonic()
        while self.seen.getRuntimeState() != PLAYING and time.monotonic() < began_s + ENDED_S:
            time.sleep(0.001)
        self.driven = self.control.setWatchdog(self.watchdog_hz)

    def obey(self, now_s: float) -> None:
        """Command the newest velocities while they are valid, else 0."""
        valid = now_s < self.newest["valid_until_s"] and now_s - self.fresh_s < STALE_S
        self.control.speedJ(self.newest["joint_velocities"] if valid else [0.0] * 6, self.most_rad_s2, PERIOD_S)
        if (late_s := time.monotonic() - now_s) > STALE_S:  # it may have been begun anew meanwhile
            print(f"ur: late by {late_s:.2f} s: the control program begins anew", flush=True)
            self.driven = False
            ask(self.robot, stop=True)

    def send(self, condition: str) -> None:
        """Send a state, if there is a robot side."""
        self.sequence, sent_s = self.sequence + 1, time.monotonic()
        state = {"version": 1, "sequence": self.sequence, "sent_s": sent_s, "measured_s": self.stamp_s + self.least_s}
        state |= {"echo_s": self.newest["sent_s"], "held_s": sent_s - self.read_s, "limits": self.limits}
        state |= {"joint_positions": self.seen.getActualQ(), "joint_velocities": self.seen.getActualQd()}
        state |= {"condition": condition, "condition_text": self.words[:200]} | self.gripper
        if self.socket.poll(0, zmq.POLLOUT):
            self.socket.send(msgpack.packb(state))


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in FASTEST:
        end(2, f"{sys.argv[1:]}; valid: a model of {', '.join(FASTEST)}, the robot's address, and NAME=VALUE ...")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        driver = Driver(*sys.argv[1:3], SAID | dict(word.split("=", 1) for word in sys.argv[3:]))
        while True:
            driver.turn()
            time.sleep(PERIOD_S)
    except KeyboardInterrupt:
        end(0, ask(sys.argv[2], stop=True))  # a stop by the watchdog would have to be cleared
    except RuntimeError as error:
        lose(sys.argv[2], error)
