"""Source of a RealSense camera's depth, for all that no model describes.

Usage: python realsense_depth.py [tcp://127.0.0.1:5604 [wrist [SERIAL]]], the last one being the camera's serial number.
It needs pyrealsense2, numpy, pyzmq and msgpack, and nothing of feelahead. A second camera is a second process, under
another name. The camera's mount is in the robot side's settings, or in MOUNT.
"""

import contextlib
import sys
import time

try:
    import msgpack
    import numpy as np
    import pyrealsense2 as rs
    import zmq
except ImportError as error:
    print(f"{error}; valid: pip install pyrealsense2 numpy pyzmq msgpack", file=sys.stderr)
    sys.exit(2)

DELAY_S = 0.13  # from exposure to the end of `wait_for_frames`, where the camera's own stamp is on no clock of ours
MOUNT = {}  # {"mount": {"link": "world", "position_m": [0.4, -0.6, 0.5], "quaternion": [0.0, 1.0, 0.0, 0.0]}}


def main(address: str = "tcp://127.0.0.1:5604", name: str = "wrist", serial: str = "") -> None:
    """Send until a signal ends it; RuntimeError without a camera."""
    socket = zmq.Context().socket(zmq.DEALER)
    socket.sndhwm, socket.linger = 2, 0
    socket.connect(address)
    pipeline, config = rs.pipeline(), rs.config()
    if serial:
        config.enable_device(serial)
    config.enable_stream(rs.stream.depth, 640, 480, rs.format.z16, 30)
    profile = pipeline.start(config)
    of = profile.get_stream(rs.stream.depth).as_video_stream_profile().get_intrinsics()
    message = {"version": 1, "sequence": 0, "camera": name, "echo_s": None} | MOUNT
    message |= {"width": of.width, "height": of.height}
    message["depth_unit_m"] = profile.get_device().first_depth_sensor().get_depth_scale()
    # RealSense counts from the centre of the upper left pixel, the robot side from its corner.
    message["intrinsics"] = {"fx": of.fx, "fy": of.fy, "cx": of.ppx + 0.5, "cy": of.ppy + 0.5}
    read_s = 0.0
    while True:
        frame = pipeline.wait_for_frames().get_depth_frame()
        if not frame:
            continue
        ours = frame.get_frame_timestamp_domain() == rs.timestamp_domain.global_time
        age_s = max(time.time() - frame.get_timestamp() / 1000.0, 0.0) if ours else DELAY_S
        message["taken_s"] = time.monotonic() - age_s
        message["depth"] = np.asanyarray(frame.get_data()).astype("<u2").tobytes()
        message["sequence"] += 1
        message["sent_s"] = time.monotonic()
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
        main(*sys.argv[1:4])
    except KeyboardInterrupt:
        pass
    except (RuntimeError, zmq.ZMQError) as error:
        print(
            f"{error}; valid: [tcp://127.0.0.1:5604 [wrist [SERIAL]]], and a camera that rs-enumerate-devices lists",
            file=sys.stderr,
        )
        sys.exit(2)
