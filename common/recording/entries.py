"""Entries of a core's inputs and outputs, in blocks of bytes: all that a replay needs.

A block is one message of the file, little-endian throughout:

    block   number u32, dropped u32, first f64, last f64, then entries
    entry   kind u8, length u32, now f64, then `length` bytes

`number` counts the blocks of one side from 0. A missing one was dropped because the recorder did not keep up;
`dropped` counts them. `first` and `last` are seconds on the side's monotonic clock.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

_BLOCK: Final = struct.Struct("<IIdd")
_ENTRY: Final = struct.Struct("<BId")


class Kind(IntEnum):
    """Kind of an entry. Text before bytes is a length u8 and the text in UTF-8."""

    RECEIVED = 1
    """A control payload was received: peer (text; its bytes), payload."""
    SENT = 2
    """A payload was sent: stream (text), peer (text; its bytes), payload."""
    TICK = 3
    """A turn of the robot side, after its STATE and FRAME: applied f64, stamp of the command that moves the arm, on the
    operator side's clock, NaN for none."""
    STATE = 4
    """The arm's measurement (robot_side/recording/inputs.py), if it differs from the previous tick's."""
    FRAME = 5
    """The camera's frame (the same file), if it differs from the previous tick's."""
    SEEN = 6
    """The operator side got a view payload; no core uses those longer than a control payload, which go elsewhere."""
    REPORT = 7
    """Input report of a DualSense, in recordings older than HANDS."""
    CALIBRATED = 8
    """The controller's travel, as JSON."""
    FOUND = 9
    """A controller was found."""
    LOST = 10
    """The controller was lost."""
    MOTION = 11
    """The operator side was polled for messages; those follow as SENT."""
    OUTPUT = 12
    """The operator side was polled for feel; that follows as TOLD, in older recordings as WRITTEN."""
    WRITTEN = 13
    """Output report for a DualSense on USB, in recordings older than TOLD."""
    STOPPED = 14
    """The emergency stop was pressed away from the controller."""
    TUNED = 15
    """Wanted settings of the run, as JSON."""
    WATCHED = 16
    """The operator side reported its watched views, under the core's next sequence number."""
    HANDS = 17
    """The controller's state (operator_side/controller/state.py), in MessagePack."""
    TOLD = 18
    """The feel sent to the controller (operator_side/controller/feel.py), in MessagePack."""
    EPISODE = 19
    """A mark of an episode counts (EpisodeMark of common/episode.py), as JSON; follows from other inputs."""
    MARKED = 20
    """A mark was made away from the controller, as JSON."""


class Entry(NamedTuple):
    """Event of a core."""

    kind: int
    now_s: float
    """Time on the side's monotonic clock, as passed to the core"""
    content: bytes


@dataclass(frozen=True)
class Block:
    """Block of one side's entries, in order."""

    number: int
    dropped: int
    """Number of this side's blocks that were dropped before this one, over the run"""
    first_s: float
    last_s: float
    entries: bytes

    def unpacked(self) -> Iterator[Entry]:
        """Yield the entries; raises ValueError if the block is invalid."""
        position, end = 0, len(self.entries)
        while position < end:
            if end - position < _ENTRY.size:
                raise ValueError("a block of entries that ends within one")
            kind, length, now_s = _ENTRY.unpack_from(self.entries, position)
            position += _ENTRY.size
            if end - position < length:
                raise ValueError("a block of entries that ends within one")
            yield Entry(kind, now_s, self.entries[position : position + length])
            position += length


def entry(kind: Kind, now_s: float, *parts: bytes) -> bytes:
    """Pack one entry."""
    content = b"".join(parts)
    return _ENTRY.pack(kind, len(content), now_s) + content


def pack_block(number: int, dropped: int, first_s: float, last_s: float, entries: bytes) -> bytes:
    """Pack one block."""
    return _BLOCK.pack(number, dropped, first_s, last_s) + entries


def unpack_block(content: bytes) -> Block:
    """Unpack a block of `pack_block`; raises ValueError if it is invalid."""
    if len(content) < _BLOCK.size:
        raise ValueError(f"a block of {len(content)} bytes; valid: {_BLOCK.size} or more")
    number, dropped, first_s, last_s = _BLOCK.unpack_from(content)
    return Block(number, dropped, first_s, last_s, content[_BLOCK.size :])


def text(value: bytes) -> bytes:
    """Pack a short text, to precede bytes."""
    return bytes([len(value)]) + value


def split_text(content: bytes) -> tuple[bytes, bytes]:
    """Split off the short text; raises ValueError if it is cut."""
    if not content or len(content) < 1 + content[0]:
        raise ValueError("a text that ends within itself")
    return content[1 : 1 + content[0]], content[1 + content[0] :]
