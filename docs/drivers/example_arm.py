"""Driver of an arm that follows velocities exactly: the built-in model's six joints and two fingers.

Usage: python example_arm.py [tcp://127.0.0.1:5601]. It needs pyzmq and msgpack, and nothing of feelahead.
"""

import contextlib
import sys
import time

import msgpack
import zmq

HOME_RAD = [-0.45168, -1.5514, 2.37501, -0.82361, 1.11912, 1.5708]
PERIOD_S, FINGER_OPEN_M, FINGER_SPEED_M_S = 0.005, 0.04248, 0.07


def main(address: str) -> None:
    """Drive until a signal ends it."""
    socket = zmq.Context().socket(zmq.DEALER)
    socket.setsockopt(zmq.SNDHWM, 2)  # old states are useless
    socket.setsockopt(zmq.LINGER, 0)
    socket.connect(address)
    joints, velocities, finger_m = list(HOME_RAD), [0.0] * 6, FINGER_OPEN_M
    newest, read_s, sequence, before_s = None, 0.0, 0, time.monotonic()
    while True:
        while socket.poll(0):  # read all, obey the newest
            message = msgpack.unpackb(socket.recv())
            if "refused" in message:
                print("refused:", message["refused"], flush=True)
            else:
                newest, read_s = message, time.monotonic()
        now_s = time.monotonic()
        valid = newest is not None and now_s < newest["valid_until_s"]
        velocities = list(newest["joint_velocities"]) if newest and valid else [0.0] * 6
        closing = newest["closing"] if newest and valid else 0.0
        passed_s, before_s = now_s - before_s, now_s
        joints = [angle + speed * passed_s for angle, speed in zip(joints, velocities, strict=True)]
        finger_m = min(max(finger_m - closing * FINGER_SPEED_M_S * passed_s, 0.0), FINGER_OPEN_M)
        sequence, sent_s = sequence + 1, time.monotonic()
        state = {
            "version": 1,
            "sequence": sequence,
            "sent_s": sent_s,
            "measured_s": now_s,
            "echo_s": newest["sent_s"] if newest else None,
            "held_s": sent_s - read_s if newest else 0.0,
            "joint_positions": joints,
            "joint_velocities": velocities,
            "finger_positions": [finger_m, finger_m],
            "opening_m": 2 * finger_m,
        }
        with contextlib.suppress(zmq.Again):  # no robot side yet
            socket.send(msgpack.packb(state), zmq.NOBLOCK)
        time.sleep(PERIOD_S)


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:5601")
    except KeyboardInterrupt:
        pass
    except zmq.ZMQError as error:
        print(f"{error}; valid: tcp://127.0.0.1:5601", file=sys.stderr)
        sys.exit(2)
