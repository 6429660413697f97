"""Source of recorded depth, sent as a camera would send it: a picture or cloud again and again, a bag once.

Usage: python recorded_depth.py FILE [tcp://127.0.0.1:5604 [recorded]]. FILE: .npz, .pcd, .ply, or the folder of a ROS 2
bag with PointCloud2. It needs feelahead, pyzmq and msgpack, and for bags rosbags. The camera stands where the file
says, in the world; else where the robot side's settings say, under its name.
"""

import contextlib
import sys
import time
from itertools import repeat
from pathlib import Path

import msgpack
import numpy as np
import zmq
from scipy.spatial.transform import Rotation

from common.errors import ConfigurationError
from robot_side.depth.recorded.pictures import recorded_pictures

PERIOD_S, UNIT_M = 1 / 15, 0.0005


def main(path: str, address: str = "tcp://127.0.0.1:5604", name: str = "recorded") -> None:
    """Send until the bag or a signal ends it; ConfigurationError for a file that cannot be read."""
    socket = zmq.Context().socket(zmq.DEALER)
    socket.sndhwm, socket.linger = 2, 1000
    socket.connect(address)
    message = {"version": 1, "sequence": 0, "camera": name, "depth_unit_m": UNIT_M, "echo_s": None}
    read_s, before_s = 0.0, None
    found = recorded_pictures(Path(path))
    for picture, pose in found if Path(path).is_dir() else repeat(next(found)):
        time.sleep(PERIOD_S if before_s in (None, picture.taken_s) else max(picture.taken_s - before_s, 0.0))
        before_s, of = picture.taken_s, picture.pinhole
        message["height"], message["width"] = picture.depth_m.shape
        message["intrinsics"] = {"fx": of.fx, "fy": of.fy, "cx": of.cx, "cy": of.cy}
        message["depth"] = np.rint(picture.depth_m / UNIT_M).clip(0, 65535).astype("<u2").tobytes()
        if pose is not None:
            turn = Rotation.from_matrix(pose.rotation).as_quat(scalar_first=True).tolist()
            message["mount"] = {"link": "world", "position_m": pose.position_m.tolist(), "quaternion": turn}
        message["sequence"] += 1
        message["taken_s"] = message["sent_s"] = time.monotonic()
        message["held_s"] = 0.0 if message["echo_s"] is None else message["sent_s"] - read_s
        with contextlib.suppress(zmq.Again):  # no robot side yet
            socket.send(msgpack.packb(message), zmq.NOBLOCK)
        while socket.poll(5):  # an answer that is read at once bounds the pictures' age best
            answer, read_s = msgpack.unpackb(socket.recv()), time.monotonic()
            print(f"refused: {answer['refused']}", flush=True) if "refused" in answer else message.update(
                echo_s=answer["sent_s"]
            )


if __name__ == "__main__":
    try:
        main(*(sys.argv[1:4] or ["FILE"]))
    except KeyboardInterrupt:
        pass
    except (ConfigurationError, zmq.ZMQError) as error:
        print(f"recorded_depth: {error}", file=sys.stderr)
        sys.exit(2)
