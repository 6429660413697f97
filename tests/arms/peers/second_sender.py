"""Another node under ROS 2 that says it is the arm (`states`), or that commands it (`goals TOPIC`), 100 times a second.

Further arguments: JOINT=POSITION ... It says `sends` and the time, in s of the monotonic clock,
once somebody hears it.
"""

import sys
import time

import rclpy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray


def main(what: str, *joints: str) -> None:
    """Send until a signal ends it."""
    rclpy.init()
    node = rclpy.create_node("second_sender")
    said = {name: float(position) for name, _, position in (joint.partition("=") for joint in joints if "=" in joint)}
    kind, topic = (JointState, "/joint_states") if what == "states" else (Float64MultiArray, joints[0])
    out = node.create_publisher(kind, topic, 1)

    began: list[float] = []

    def send() -> None:
        if not node.count_subscribers(out.topic_name):
            return
        if not began:
            began.append(time.monotonic())
            print("sends", *began, flush=True)
        if what == "states":
            state = JointState(name=list(said), position=list(said.values()), velocity=[0.0] * len(said))
            state.header.stamp = node.get_clock().now().to_msg()
            out.publish(state)
        else:
            out.publish(Float64MultiArray(data=list(said.values())))

    node.create_timer(0.01, send)
    rclpy.spin(node)


if __name__ == "__main__":
    main(*sys.argv[1:])
