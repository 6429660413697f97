"""Source of the depth that a camera under ROS 2 publishes (rclpy), in your own ROS environment with pyzmq and msgpack.

Usage: python docs/drivers/ros2_depth.py image|cloud TOPIC [NAME=VALUE ...], in feelahead's clone. Names: address;
camera; info, the topic with CameraInfo; rectified=yes: P counts, not K and D; latency_s, from exposure until a message
is here, for stamps of another clock. A cloud, PointCloud2, has z ahead.
"""

import contextlib
import re
import sys
import time
from functools import partial
from pathlib import Path

if "--help" in sys.argv:
    print(__doc__, end="")
    sys.exit()
try:
    import msgpack
    import numpy as np
    import rclpy
    import zmq
    from rclpy.exceptions import NameValidationException
    from rclpy.executors import ExternalShutdownException
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import CameraInfo, Image, PointCloud2

    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # feelahead's clone
    from robot_side.depth.recorded.cloud import VirtualCamera, depth_of
    from robot_side.depth.recorded.ros_messages import cloud_of, depth_of_image, pinhole_of
except ImportError as error:
    print(f"{error}; valid: a sourced ROS 2 with numpy, pyzmq and msgpack, and feelahead's clone", file=sys.stderr)
    sys.exit(2)

WORDS = {"address": "tcp://127.0.0.1:5604", "camera": "wrist", "info": "", "rectified": "no", "latency_s": ""}
UNIT_M, EARLY_S, OLDEST_S, SILENT_S, MOST_PIXELS = 0.0002, 0.02, 1.0, 5.0, 1_500_000


class Source:
    """Depth of one topic, which becomes messages to the robot side."""

    def __init__(self, kind: str, topic: str, said: dict[str, str]) -> None:
        self.latency_s, self.rectified, self.info = float(said["latency_s"] or "nan"), said["rectified"] == "yes", None
        self.message = {"version": 1, "sequence": 0, "camera": said["camera"], "depth_unit_m": UNIT_M, "echo_s": None}
        self.read_s, self.before, self.topics, self.address = 0.0, 0, [topic], said["address"]
        self.socket, self.node = zmq.Context().socket(zmq.DEALER), rclpy.create_node("feelahead_depth")
        self.socket.sndhwm, self.socket.linger = 2, 0  # old pictures are useless
        self.socket.connect(self.address)
        newest = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        if kind == "image":
            self.topics.append(said["info"] or topic.rpartition("/")[0] + "/camera_info")
            self.node.create_subscription(CameraInfo, self.topics[1], partial(setattr, self, "info"), newest)
        self.node.create_subscription({"image": Image, "cloud": PointCloud2}[kind], topic, self.see, newest)
        self.node.create_timer(SILENT_S, self.complain)

    def see(self, seen: Image | PointCloud2) -> None:
        """Send an image, or a cloud as a camera at its origin sees it; ValueError names what is invalid."""
        now_s, stamp = time.monotonic(), seen.header.stamp
        age_s = self.latency_s if self.latency_s >= 0.0 else time.time() - stamp.sec - 1e-9 * stamp.nanosec
        if not -EARLY_S <= age_s <= OLDEST_S:
            text = f"its stamp is {age_s:.3g} s before this machine's clock; valid: up to {OLDEST_S:g}, or latency_s=…"
            self.node.get_logger().warning(f"a picture is left out: {text}", throttle_duration_sec=SILENT_S)
        elif isinstance(seen, PointCloud2):
            self.send(now_s - max(age_s, 0.0), *depth_of(cloud_of(seen, self.topics[0]), VirtualCamera()))
        elif self.info is not None:
            self.send(now_s - max(age_s, 0.0), depth_of_image(seen), pinhole_of(self.info, seen, self.rectified))

    def complain(self) -> None:
        """Say who publishes what, if nothing was sent since the last time, or that no robot side answers."""
        if self.message["sequence"] == self.before:
            there = {one: [by.topic_type for by in self.node.get_publishers_info_by_topic(one)] for one in self.topics}
            said = (f"{one} has {len(by)} publishers{' of '.join(['', *sorted({*by})])}" for one, by in there.items())
            print(f"nothing is sent: {', '.join(said)}", flush=True)
        elif time.monotonic() - self.read_s > SILENT_S:
            print(f"no robot side answers at {self.address}", flush=True)
        self.before = self.message["sequence"]

    def send(self, taken_s: float, depth_m: np.ndarray, of: object) -> None:
        """Send depth (h, w), and read answers; ValueError if it is too large."""
        self.message["taken_s"], (height, width) = taken_s, depth_m.shape
        if depth_m.size > MOST_PIXELS:
            raise ValueError(f"{width} x {height} pixels; valid: up to {MOST_PIXELS}")
        near_m = np.where(depth_m < 65535 * UNIT_M, depth_m, 0.0)
        self.message |= {"width": width, "height": height, "depth": np.rint(near_m / UNIT_M).astype("<u2").tobytes()}
        self.message |= {"intrinsics": vars(of), "sequence": self.message["sequence"] + 1, "sent_s": time.monotonic()}
        self.message["held_s"] = 0.0 if self.message["echo_s"] is None else self.message["sent_s"] - self.read_s
        with contextlib.suppress(zmq.Again):  # no robot side yet
            self.socket.send(msgpack.packb(self.message), zmq.NOBLOCK)
        while self.socket.poll(5):  # an answer that is read at once bounds the pictures' age best
            answer, self.read_s = msgpack.unpackb(self.socket.recv()), time.monotonic()
            if "refused" in answer:
                print(f"refused: {answer['refused']}", flush=True)
            else:
                self.message["echo_s"] = answer["sent_s"]


if __name__ == "__main__":
    words, said = sys.argv[1:], WORDS | dict(word.partition("=")[::2] for word in sys.argv[3:])
    known = len(words) > 1 and words[0] in ("image", "cloud") and said.keys() == WORDS.keys()
    try:
        if not (known and said["rectified"] in ("yes", "no") and re.fullmatch(r"(0?\.\d+)?", said["latency_s"])):
            names = "address, camera, info, rectified=yes|no, latency_s=0.05"
            raise ValueError(f"{words}; valid: image|cloud TOPIC [NAME=VALUE ...], names: {names}")
        rclpy.init()
        with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
            rclpy.spin(Source(*words[:2], said).node)
    except (ValueError, NameValidationException, zmq.ZMQError) as error:
        print(*str(error).split(), file=sys.stderr)
        sys.exit(2)
