"""Source of a camera's pictures, as the first-person view or as the overview.

Usage: python example_pictures.py [tcp://127.0.0.1:5603 [overview [0]]], the last one being the camera's number. It
needs opencv-python, pyzmq and msgpack, and nothing of feelahead. With pyrealsense2 these lines replace OpenCV's:
    pipeline = rs.pipeline()
    of = pipeline.start().get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
    pinhole = {"intrinsics": {"fx": of.fx, "fy": of.fy, "cx": of.ppx, "cy": of.ppy}}
    picture = np.asarray(pipeline.wait_for_frames().get_color_frame().get_data())[:, :, ::-1]  # in the loop
"""

import contextlib
import sys
import time

try:
    import cv2
    import msgpack
    import zmq
except ImportError as error:
    print(f"{error}; valid: pip install opencv-python pyzmq msgpack", file=sys.stderr)
    sys.exit(2)

DELAY_S = 0.05  # from exposure to the end of `read`: measure it, say by pictures of a running clock


def main(address: str = "tcp://127.0.0.1:5603", view: str = "first_person", number: str = "0") -> None:
    """Send until a signal ends it; OSError if the camera gives no picture."""
    socket = zmq.Context().socket(zmq.DEALER)
    socket.sndhwm, socket.linger = 2, 0
    socket.connect(address)
    camera = cv2.VideoCapture(int(number))
    pinhole = {}  # for the overlay, "intrinsics" as cv2.calibrateCamera finds them
    message = {"version": 1, "sequence": 0, "view": view, "format": "jpeg", "echo_s": None} | pinhole
    read_s = 0.0
    while True:
        good, picture = camera.read()
        if not good:
            raise OSError(f"camera {number} gives no picture")
        message["taken_s"], message["bytes"] = time.monotonic() - DELAY_S, cv2.imencode(".jpg", picture)[1].tobytes()
        message["sequence"], (message["height"], message["width"]) = message["sequence"] + 1, picture.shape[:2]
        message["sent_s"] = time.monotonic()
        message["held_s"] = 0.0 if message["echo_s"] is None else message["sent_s"] - read_s
        with contextlib.suppress(zmq.Again):  # no robot side yet
            socket.send(msgpack.packb(message), zmq.NOBLOCK)
        while socket.poll(5):  # an answer that is read at once bounds the pictures' age best
            answer, read_s = msgpack.unpackb(socket.recv()), time.monotonic()
            if "refused" in answer:
                print("refused:", answer["refused"], flush=True)
            else:
                message["echo_s"] = answer["sent_s"]


if __name__ == "__main__":
    try:
        main(*sys.argv[1:4])
    except KeyboardInterrupt:
        pass
    except (OSError, ValueError, zmq.ZMQError) as error:
        print(f"{error}; valid: [tcp://127.0.0.1:5603 [first_person|overview [0]]]", file=sys.stderr)
        sys.exit(2)
