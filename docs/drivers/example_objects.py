"""Source of made-up objects at 30 Hz: a table, a target on it, and a ball that moves to and fro.

Usage: python example_objects.py [tcp://127.0.0.1:5602]. It needs pyzmq and msgpack, and nothing of feelahead.
"""

import contextlib
import math
import sys
import time

import msgpack
import zmq


def main(address: str = "tcp://127.0.0.1:5602") -> None:
    """Send until a signal ends it."""
    socket = zmq.Context().socket(zmq.DEALER)
    socket.sndhwm, socket.linger = 2, 0
    socket.connect(address)
    sequence, next_s, echo = 0, time.monotonic(), (None, 0.0)
    while True:
        sequence, now_s = sequence + 1, time.monotonic()
        side_m, speed_m_s = 0.1 * math.sin(now_s), 0.1 * math.cos(now_s)
        table = {"name": "table", "half_space": True}
        target = {"name": "target", "box": [0.02, 0.02, 0.05], "position_m": [0.6, 0.0, 0.05], "sd_m": 0.003}
        ball = {"name": "ball", "sphere": 0.03, "position_m": [0.5, side_m, 0.2], "velocity_m_s": [0.0, speed_m_s, 0.0]}
        echo_s, read_s = echo
        frame = {"version": 1, "sequence": sequence, "sent_s": now_s, "taken_s": now_s}
        frame |= {"echo_s": echo_s, "held_s": 0.0 if echo_s is None else now_s - read_s}
        frame |= {"objects": [table, target, ball]}
        with contextlib.suppress(zmq.Again):  # no robot side yet
            socket.send(msgpack.packb(frame), zmq.NOBLOCK)
        next_s = max(next_s + 1 / 30, now_s)
        # An answer's time of reading bounds the frames' age.
        while socket.poll(1e3 * max(next_s - time.monotonic(), 0.0)):
            answer, read_s = msgpack.unpackb(socket.recv()), time.monotonic()
            if "refused" in answer:
                print("refused:", answer["refused"], flush=True)
            else:
                echo = answer["sent_s"], read_s


if __name__ == "__main__":
    try:
        main(*sys.argv[1:2])
    except KeyboardInterrupt:
        pass
    except zmq.ZMQError as error:
        print(f"{error}; valid: tcp://127.0.0.1:5602", file=sys.stderr)
        sys.exit(2)
