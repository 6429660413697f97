"""Messages between the door and the process that ticks. Each is one message of a `Channel`."""

from typing import Final, Literal

import msgspec
from msgspec import Struct

from common.sockets.key_files import KeyRole
from common.sockets.tcp_figures import TcpFigures

ROOM_BYTES: Final = 1 << 23
"""Bytes that wait at either end of the channel at most; messages beyond are dropped"""


class DriverSettings(Struct, frozen=True):
    """Port to which programs of the user connect."""

    bind: str
    role: KeyRole
    """Role of the keys that are let in"""
    limit_bytes: int
    """Largest valid message"""
    bytes_per_s: float
    """Budget of each connection"""
    on_request: bool = False
    """Whether only the newest messages pass on, and only after `Take`"""


class DoorSettings(Struct, frozen=True):
    """Settings of a door."""

    bind: str
    view_bind: str | None = None
    drivers: dict[str, DriverSettings] = {}
    """Ports of programs, keyed by flag"""
    insecure: bool = False
    keys: str | None = None
    """Folder of keys; None admits everybody"""
    listens: bool = False
    """Whether to open the ports of operators at once, without `Listen`"""


class FromPeer(Struct, frozen=True, array_like=True, tag=1):
    """Control message that has arrived."""

    peer: bytes
    payload: bytes


class FromDriver(Struct, frozen=True, array_like=True, tag=2):
    """Message of a user's program that has arrived."""

    flag: str
    peer: bytes
    payload: bytes
    received_s: float
    """Time at which it was taken from the socket, on the machine's monotonic clock"""


class Ready(Struct, frozen=True, array_like=True, tag=3):
    """The ports of programs are bound, and those of operators can be."""

    drivers: dict[str, str]
    """Bound addresses, keyed by flag"""
    notes: list[str]


class Listening(Struct, frozen=True, array_like=True, tag=4):
    """The ports of operators are bound."""

    control: str
    view: str


class Failed(Struct, frozen=True, array_like=True, tag=5):
    """A setting is wrong, or a port cannot be bound; the companion ends."""

    text: str


Kind = Literal["connected", "left", "refused", "revoked", "barred", "cut off"]


class Event(Struct, frozen=True, array_like=True):
    """Event at a port, for the audit log."""

    kind: Kind
    who: str
    """Name of the key, or the key itself if it is unknown; empty without keys"""
    where: str
    """Address and port at the other end, as far as it is known"""
    peer: bytes = b""
    """Name of the peer at the control port"""


class Figures(Struct, frozen=True, array_like=True, tag=6):
    """Figures of the ports since they were opened; sent ten times a second, and before the end."""

    counts: dict[str, int]
    tcp: TcpFigures
    """Figures of the owner's connections"""
    notes: list[str]
    events: list[Event]
    busiest: str
    """Peer that sent most bytes at the newest look that saw any, in words; empty before"""


class ToPeer(Struct, frozen=True, array_like=True, tag=1):
    """Control message to send; everywhere: over each of the peer's connections."""

    peer: bytes
    payload: bytes
    everywhere: bool


class ToViewers(Struct, frozen=True, array_like=True, tag=2):
    """Message for all viewers who subscribe to `topic`."""

    topic: bytes
    payload: bytes


class ToDriver(Struct, frozen=True, array_like=True, tag=3):
    """Message to a user's program."""

    flag: str
    peer: bytes
    payload: bytes


class Owner(Struct, frozen=True, array_like=True, tag=4):
    """Peer that owns the lease: its messages are never dropped for those of others."""

    peer: bytes | None


class Listen(Struct, frozen=True, array_like=True, tag=5):
    """Bind the ports of operators."""


class Close(Struct, frozen=True, array_like=True, tag=6):
    """Send the last figures, then end."""


class Take(Struct, frozen=True, array_like=True, tag=7):
    """Pass on the newest messages of a port that passes on request, now or as soon as there are any."""

    flag: str


Said = FromPeer | FromDriver | Ready | Listening | Failed | Figures
Asked = ToPeer | ToViewers | ToDriver | Owner | Listen | Close | Take

encode: Final = msgspec.msgpack.Encoder().encode
decode_said: Final = msgspec.msgpack.Decoder(Said).decode
decode_asked: Final = msgspec.msgpack.Decoder(Asked).decode
