"""Attackers, each a process of its own: python -m tests.soak.attacks KIND ENDPOINT FOLDER NAME."""

import contextlib
import os
import random
import socket
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import msgpack
import zmq

from common.sockets.authentication import OperatorKeys
from common.sockets.keys import KeyFolder
from tests.helpers.hostile.raw_zmtp import GREETING, port_of

_NICENESS: Final = 10
"""Attackers usually compute elsewhere: here they leave the processors to the sides."""
_ENDLESS: Final = 100_000


def keyed(kind: int, keys: OperatorKeys, endpoint: str) -> "zmq.Socket[bytes]":
    """Connect a socket with a key."""
    part: zmq.Socket[bytes] = zmq.Context.instance().socket(kind)
    for option, value in ((zmq.LINGER, 0), (zmq.SNDHWM, 5000), (zmq.RECONNECT_IVL, 200)):
        part.setsockopt(option, value)
    keys.secure(part)
    part.connect(endpoint)
    return part


def tiny(part: "zmq.Socket[bytes]") -> Iterator[None]:
    """Send messages of one byte, as fast as they are taken."""
    while True:
        for _ in range(1000):
            with contextlib.suppress(zmq.Again):
                part.send(b"x", zmq.NOBLOCK)
        yield


def endless(part: "zmq.Socket[bytes]") -> Iterator[None]:
    """Send one message of very many parts, again and again."""
    while True:
        with contextlib.suppress(zmq.Again):
            for _ in range(_ENDLESS):
                part.send(bytes(4000), zmq.SNDMORE | zmq.NOBLOCK)
        yield


def large(part: "zmq.Socket[bytes]") -> Iterator[None]:
    """Send messages of a megabyte."""
    noise = bytes(1_000_000)
    while True:
        with contextlib.suppress(zmq.Again):
            part.send(noise, zmq.NOBLOCK)
        yield


def wordy(part: "zmq.Socket[bytes]") -> Iterator[None]:
    """Send messages whose fault is a long word, which a refusal could quote."""
    message = msgpack.packb({"a \x1b" * 300_000: 1})
    while True:
        with contextlib.suppress(zmq.Again):
            part.send(message, zmq.NOBLOCK)
        yield


def lying(part: "zmq.Socket[bytes]") -> Iterator[None]:
    """Send states of an arm that jumps, as another driver."""
    generator, sequence = random.Random(7), 0  # noqa: S311  # repeatable, not secret
    while True:
        sequence += 1
        now_s = time.monotonic()
        positions = [generator.uniform(-1e6, 1e6) for _ in range(6)]
        state = {
            **{"version": 1, "sequence": sequence, "sent_s": now_s, "measured_s": now_s, "echo_s": None},
            **{"held_s": 0.0, "joint_positions": positions, "joint_velocities": [1e6] * 6},
        }
        with contextlib.suppress(zmq.Again):
            part.send(msgpack.packb(state), zmq.NOBLOCK)
        time.sleep(0.002)
        yield


def subscriptions(part: "zmq.Socket[bytes]") -> Iterator[None]:
    """Subscribe to topics of four megabytes."""
    while True:
        part.setsockopt(zmq.SUBSCRIBE, os.urandom(16) * 250_000)
        time.sleep(0.05)
        yield


def strangers(endpoint: str) -> Iterator[None]:
    """Connect without a key: garbage, half a handshake, nothing; keep some connections open."""
    kept: list[socket.socket] = []
    generator = random.Random(11)  # noqa: S311  # repeatable, not secret
    while True:
        with contextlib.suppress(OSError):
            each = socket.create_connection(("127.0.0.1", port_of(endpoint)), 1.0)
            each.setblocking(False)
            kept.append(each)
            each.send(generator.choice([b"", GREETING[:10], GREETING, generator.randbytes(300)]))
        while len(kept) > 300:
            kept.pop(0).close()
        time.sleep(0.001)
        yield


KINDS: Final[dict[str, tuple[int, Callable[["zmq.Socket[bytes]"], Iterator[None]]]]] = {
    "tiny": (zmq.DEALER, tiny),
    "endless": (zmq.DEALER, endless),
    "large": (zmq.DEALER, large),
    "wordy": (zmq.DEALER, wordy),
    "lying": (zmq.DEALER, lying),
    "subscriptions": (zmq.SUB, subscriptions),
}


def main(kind: str, endpoint: str, folder: str, name: str) -> None:
    """Attack until a signal ends it; connect anew every five seconds, as a refused connection does not by itself."""
    os.nice(_NICENESS)
    if kind == "strangers":
        for _ in strangers(endpoint):
            pass
    keys = OperatorKeys.load(Path(folder) / name, str(KeyFolder(Path(folder) / "robot").public_path("robot")))
    socket_type, attack = KINDS[kind]
    while True:
        part, end_s = keyed(socket_type, keys, endpoint), time.monotonic() + 5.0
        for _ in attack(part):
            if time.monotonic() > end_s:
                break
        part.close(linger=0)


if __name__ == "__main__":
    main(*sys.argv[1:])
