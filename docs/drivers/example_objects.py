"""Source of made-up objects at 30 Hz: a table, a target on it, and a ball that moves to and fro.

Usage: python example_objects.py [tcp://127.0.0.1:5602]. It needs pyzmq and msgpack, and nothing of feelahead.
"""

import contextlib
import math
import sys
import time

import msgpack
import zmq

socket = zmq.Context().socket(zmq.DEALER)
socket.setsockopt(zmq.SNDHWM, 2)
socket.connect(sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:5602")
sequence = 0
while True:
    sequence, now_s = sequence + 1, time.monotonic()
    side_m, speed_m_s = 0.1 * math.sin(now_s), 0.1 * math.cos(now_s)
    table = {"name": "table", "half_space": True}
    target = {"name": "target", "box": [0.02, 0.02, 0.05], "position_m": [0.6, 0.0, 0.05], "sd_m": 0.003}
    ball = {"name": "ball", "sphere": 0.03, "position_m": [0.5, side_m, 0.2], "velocity_m_s": [0.0, speed_m_s, 0.0]}
    frame = {"version": 1, "sequence": sequence, "sent_s": now_s, "taken_s": now_s, "objects": [table, target, ball]}
    with contextlib.suppress(zmq.Again):  # no robot side yet
        socket.send(msgpack.packb(frame), zmq.NOBLOCK)
    while socket.poll(0):
        print("refused:", msgpack.unpackb(socket.recv())["refused"], flush=True)
    time.sleep(1 / 30)
