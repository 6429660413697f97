"""Driver of an arm under ROS 2 (rclpy), in your own ROS environment with pyzmq and msgpack.

Usage: python ros2_arm.py positions|trajectory TOPIC JOINT,JOINT,... [NAME=VALUE ...], the joints in the model's order.
Names: address, loads (yes: efforts are loads), velocity_rad_s, acceleration_rad_s2, latency_s. TOPIC is that of a
controller that holds the last goal if this process dies. /joint_states needs stamps and velocities, in any order.
"""

import math
import sys
import time

try:
    import msgpack
    import rclpy
    import zmq
    from builtin_interfaces.msg import Duration
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
except ImportError as error:
    print(f"{error}; valid: a sourced ROS 2 with pyzmq and msgpack", file=sys.stderr)
    sys.exit(2)

PERIOD_S, LEAD_RAD, SILENT_S, DOUBT_S, AHEAD_NS, DRIFT_S = 0.01, 0.1, 0.1, 1.0, 50_000_000, 1e-5
KINDS = {"positions": Float64MultiArray, "trajectory": JointTrajectory}


class Arm(Node):
    """Arm whose joints are seen on /joint_states, and follow goals that are sent to a topic."""

    def __init__(self, kind: str, topic: str, joints: list[str], said: dict[str, str]) -> None:
        super().__init__("feelahead_arm")
        self.joints, self.seen, self.least_s, self.loads = joints, {}, {}, said.pop("loads", "no") == "yes"
        self.newest, self.read_s, self.goals = {"valid_until_s": -math.inf, "sent_s": None}, time.monotonic(), ()
        self.socket, address = zmq.Context().socket(zmq.DEALER), said.pop("address", "tcp://127.0.0.1:5601")
        self.socket.sndhwm, self.socket.linger = 2, 0  # old states are useless
        self.socket.connect(address)
        limits = {name: float(one) if name == "latency_s" else [float(one)] * len(joints) for name, one in said.items()}
        self.turned_s, self.doubt_s, self.state = self.read_s, 0.0, {"version": 1, "sequence": 0, "limits": limits}
        self.kind, self.topic, self.out = kind, topic, self.create_publisher(KINDS[kind], topic, 1)
        self.create_subscription(JointState, "/joint_states", self.see, qos_profile_sensor_data)
        self.create_timer(PERIOD_S, self.turn)

    def see(self, message: JointState, about: dict[str, int]) -> None:
        """Keep what a message says of each joint; it is as old as it comes later than the quickest ones."""
        stamp_s, now_s = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec, time.monotonic()
        number, loads = about["publication_sequence_number"], message.effort or [0.0] * len(message.name)
        for name, *values in zip(message.name, message.position, message.velocity, loads, strict=False):
            if number < self.seen.get(name, (0,))[-1] and name in self.joints:  # by another sender, or it began anew
                self.doubt_s = now_s + DOUBT_S
            self.least_s[name] = min(self.least_s.get(name, math.inf) + DRIFT_S, now_s - stamp_s)
            self.seen[name] = (stamp_s + self.least_s[name], *values, number)

    def turn(self) -> None:
        """Obey the newest command, and send a state."""
        while self.socket.poll(0):
            message = msgpack.unpackb(self.socket.recv())
            if "refused" in message:
                print("refused:", message["refused"], flush=True)
            else:
                self.newest, self.read_s = message, time.monotonic()
        newest, now_s, since_s = self.newest, time.monotonic(), max(self.turned_s, time.monotonic() - SILENT_S)
        if missing := {*self.joints} - self.seen.keys():
            self.get_logger().warning(f"/joint_states lacks {missing}", throttle_duration_sec=5.0)
            return
        at_s, here, speeds, loads, _ = zip(*(self.seen[name] for name in self.joints), strict=True)
        valid_s, self.turned_s = min(now_s, newest["valid_until_s"]) - since_s, now_s
        if valid_s <= 0.0 or not self.goals or now_s - min(at_s) > SILENT_S or now_s < self.doubt_s:
            self.goals = here
        elif any(newest["joint_velocities"]):
            ways = zip(self.goals, newest["joint_velocities"], here, strict=True)
            self.goals = [min(max(goal + speed * valid_s, at - LEAD_RAD), at + LEAD_RAD) for goal, speed, at in ways]
            point = JointTrajectoryPoint(positions=self.goals, time_from_start=Duration(nanosec=AHEAD_NS))
            path = JointTrajectory(joint_names=self.joints, points=[point])
            self.out.publish(Float64MultiArray(data=self.goals) if self.kind == "positions" else path)
        alone = self.count_publishers(self.topic) == 1 and self.count_subscribers(self.topic) > 0
        wrong = "" if alone else f"{self.topic}: valid: this sender alone, and a controller"
        wrong = "/joint_states: two nodes send the same joint; valid: one" if now_s < self.doubt_s else wrong
        self.state |= {"condition": "fault" if wrong else "ready", "condition_text": wrong}
        self.state |= {"sent_s": (sent_s := time.monotonic()), "measured_s": min(at_s), "echo_s": newest["sent_s"]}
        self.state |= {"held_s": sent_s - self.read_s, "joint_positions": here, "joint_velocities": speeds}
        self.state |= {"sequence": self.state["sequence"] + 1} | ({"joint_loads": loads} if self.loads else {})
        if self.socket.poll(0, zmq.POLLOUT):  # there is a robot side
            self.socket.send(msgpack.packb(self.state))


if __name__ == "__main__":
    kind, topic, joints, *more = sys.argv[1:] if len(sys.argv) > 3 else [""] * 3
    if kind not in KINDS or "velocit" in topic or not joints or not all("=" in word for word in more):
        why = "a topic of velocities goes on if this process dies"
        usage = "positions|trajectory TOPIC JOINT,JOINT,... [NAME=VALUE ...]"
        print(f"{' '.join(sys.argv[1:])}; valid: {usage}; {why}", file=sys.stderr)
        sys.exit(2)
    rclpy.init()
    rclpy.spin(Arm(kind, topic, joints.split(","), dict(word.split("=", 1) for word in more)))
