"""Arm under ROS 2: /joint_states in an order of its own, and a controller of positions or of trajectories.

Usage: ros2.py LOG JOINT=START-RAD ...; orders on the standard input: `silent SECONDS`, `late SECONDS FOR-SECONDS`.
The joints follow their goals with a time constant of 30 ms, at most at 2.5 rad/s, and change their speed by at most
15 rad/s². They know nothing of who sends the goals: a goal is held until the next one comes.
"""

import sys
import time
from collections import deque

import rclpy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from tests.arms.peers.positions import hear_orders, log_positions

PERIOD_S, LAG_S, FASTEST_RAD_S, MOST_RAD_S2 = 0.005, 0.03, 2.5, 15.0


class SimulatedArm:
    """Joints that follow goals, and the node that speaks for them."""

    def __init__(self, start: dict[str, float]) -> None:
        self.positions, self.goals = dict(start), dict(start)
        self._speeds, self._steps = dict.fromkeys(start, 0.0), dict.fromkeys(start, 0.0)
        self._since_s, self._until_s = time.monotonic(), 0.0
        self._silent_until_s = self._late_s = self._late_until_s = 0.0
        self._waiting: deque[tuple[float, JointState]] = deque()
        node = self.node = rclpy.create_node("simulated_arm")
        self._out = node.create_publisher(JointState, "/joint_states", QoSProfile(depth=1))
        self._aims = dict(start)
        node.create_subscription(Float64MultiArray, "/forward_position_controller/commands", self._position, 1)
        node.create_subscription(JointTrajectory, "/joint_trajectory_controller/joint_trajectory", self._path, 1)
        node.create_timer(PERIOD_S, self._turn)

    def obey(self, words: list[str]) -> None:
        """Be silent, or late, for some seconds."""
        now_s = time.monotonic()
        if words[0] == "silent":
            self._silent_until_s = now_s + float(words[1])
        elif words[0] == "late":
            self._late_s, self._late_until_s = float(words[1]), now_s + float(words[2])

    def _position(self, message: Float64MultiArray) -> None:
        self._aim(dict(zip(self._aims, message.data, strict=True)), PERIOD_S)

    def _path(self, message: JointTrajectory) -> None:
        last = message.points[-1]
        seconds = last.time_from_start.sec + 1e-9 * last.time_from_start.nanosec
        self._aim(dict(zip(message.joint_names, last.positions, strict=True)), seconds)

    def _aim(self, aims: dict[str, float], seconds: float) -> None:
        """Lead the goals to `aims` within some seconds."""
        self._aims, self._until_s = aims, time.monotonic() + seconds

    def _turn(self) -> None:
        now_s = time.monotonic()
        passed_s, self._since_s = min(now_s - self._since_s, 0.1), now_s
        share = min(passed_s / max(self._until_s - now_s + passed_s, passed_s), 1.0)
        for name, here in self.positions.items():
            self.goals[name] += share * (self._aims[name] - self.goals[name])
            wanted = min(max((self.goals[name] - here) / LAG_S, -FASTEST_RAD_S), FASTEST_RAD_S)
            change = min(max(wanted - self._speeds[name], -MOST_RAD_S2 * passed_s), MOST_RAD_S2 * passed_s)
            self._speeds[name] += change
            self.positions[name] = here + self._speeds[name] * passed_s
        self._say(now_s)

    def _say(self, now_s: float) -> None:
        shown = sorted(self.positions, reverse=True)
        said = JointState(name=shown, position=[self.positions[name] for name in shown])
        said.velocity, said.header.stamp = [self._speeds[name] for name in shown], self.node.get_clock().now().to_msg()
        self._waiting.append((now_s + (self._late_s if now_s < self._late_until_s else 0.0), said))
        while self._waiting and self._waiting[0][0] <= now_s:
            _, message = self._waiting.popleft()
            if now_s >= self._silent_until_s:
                self._out.publish(message)


def main(log: str, *joints: str) -> None:
    """Move and speak until a signal ends it."""
    rclpy.init()
    arm = SimulatedArm({name: float(start) for name, _, start in (joint.partition("=") for joint in joints)})
    names = sorted(arm.positions)
    log_positions(log, lambda: [arm.positions[name] for name in names])
    hear_orders(arm.obey)
    print("serves", flush=True)
    rclpy.spin(arm.node)


if __name__ == "__main__":
    main(*sys.argv[1:])
