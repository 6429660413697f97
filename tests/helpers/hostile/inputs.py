"""Random inputs of a hostile or broken peer, repeatable by a seed."""

import contextlib
import random
from collections.abc import Callable

import msgpack

from common.protocol.codec import MAXIMUM_BYTES, PROTOCOL_VERSION, encode
from common.protocol.messages import Header, Hello, MotionCommand
from tests.helpers.hostile.raw_zmtp import GREETING, RawConnection, frame, message, ready

_STRANGERS = 8
_HANGING = 128
"""Maximum number of connections that stay open without finishing their handshake"""


def payload(generator: random.Random) -> bytes:
    """Return a random bad payload: noise, a message cut or altered, nested arrays, or impossible numbers."""
    kind = generator.randrange(5)
    if kind == 0:
        return generator.randbytes(generator.randrange(MAXIMUM_BYTES))
    if kind == 1:
        return bytes(_valid(generator)[: generator.randrange(60)])
    if kind == 2:
        spoiled = bytearray(_valid(generator))
        for _ in range(generator.randint(1, 4)):
            spoiled[generator.randrange(len(spoiled))] = generator.randrange(256)
        return bytes(spoiled)
    if kind == 3:
        return b"\x91" * generator.randrange(MAXIMUM_BYTES)  # Nested arrays.
    odd: float = generator.choice([float("nan"), float("inf"), 1e308, -1.0, 2**64 - 1])
    content: bytes = msgpack.packb([PROTOCOL_VERSION, ["motion", [1, 2, odd, None, None], odd, odd, [odd, odd]]])
    return content


def _valid(generator: random.Random) -> bytes:
    header = Header(epoch=generator.getrandbits(53), sequence=generator.getrandbits(40), sent_s=generator.random())
    if generator.random() < 0.5:
        return encode(Hello(header, side="operator", clock_domain=""))
    return encode(MotionCommand(header, l2=1.0, r2=1.0, run=True, arm=True))


class Attacker:
    """Hostile peer that sends one random input at a time to a robot side's control port or view port."""

    def __init__(self, control_port: int, view_port: int, seed: int) -> None:
        self._control_port = control_port
        self._view_port = view_port
        self._generator = random.Random(seed)  # noqa: S311  # repeatable, not secret
        self._strangers: list[RawConnection] = []
        self._hanging: list[RawConnection] = []
        self._kinds: dict[Callable[[], None], int] = {
            self._send_payload: 780,
            self._send_frames: 60,
            self._send_oversize: 20,
            self._connect_with_garbage: 60,
            self._connect_halfway: 50,
            self._disturb_view: 30,
        }

    def send(self) -> None:
        """Send one hostile input. No error if the robot side or the system ends the connection meanwhile."""
        [send] = self._generator.choices(list(self._kinds), list(self._kinds.values()))
        with contextlib.suppress(OSError):
            send()

    def close(self) -> None:
        """Close all connections that are still open."""
        for connection in (*self._strangers, *self._hanging):
            connection.close()

    def _stranger(self) -> RawConnection:
        self._strangers = [connection for connection in self._strangers if connection.open]
        if len(self._strangers) < _STRANGERS:
            self._strangers.append(RawConnection.introduced(self._control_port))
        return self._generator.choice(self._strangers)

    def _send_payload(self) -> None:
        self._stranger().send(message(payload(self._generator)))

    def _send_frames(self) -> None:
        count = self._generator.choice([2, 3, 50])
        self._stranger().send(message(*[self._generator.randbytes(3)] * count))

    def _send_oversize(self) -> None:
        claimed = self._generator.choice([MAXIMUM_BYTES + 1, 10**6, 2**31, 2**62, 2**64 - 1])
        self._stranger().send(frame(bytes(100), claimed_bytes=claimed))

    def _connect_with_garbage(self) -> None:
        garbage = self._generator.randbytes(self._generator.randint(1, 2000))
        RawConnection(self._control_port, garbage).close()

    def _connect_halfway(self) -> None:
        whole = GREETING + ready(b"DEALER")
        connection = RawConnection(self._control_port, whole[: self._generator.randrange(len(whole))])
        self._hanging.append(connection)
        if len(self._hanging) > _HANGING:
            self._hanging.pop(self._generator.randrange(_HANGING)).close()

    def _disturb_view(self) -> None:
        if self._generator.random() < 0.5:
            RawConnection(self._view_port, self._generator.randbytes(100)).close()
            return
        viewer = RawConnection.introduced(self._view_port, b"SUB")
        viewer.send(message(b"\x01" + self._generator.randbytes(20)) + frame(b"", claimed_bytes=2**40))
        viewer.close()
