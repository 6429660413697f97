"""What happened to a core, one entry after another, in blocks of bytes: all that is needed to do it again.

A block is one message of the file, little-endian throughout:

    block   number u32, dropped u32, first f64, last f64, then entries
    entry   kind u8, length u32, now f64, then `length` bytes

`number` counts the blocks of one side from 0. One that is missing was dropped, as the recorder did not keep up;
`dropped` says how many were, so far. `first` and `last` are seconds on the side's monotonic clock.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

_BLOCK: Final = struct.Struct("<IIdd")
_ENTRY: Final = struct.Struct("<BId")


class Kind(IntEnum):
    """What an entry tells. Text before bytes is a length u8 and the text in UTF-8."""

    RECEIVED = 1
    """A control payload came in: peer (text; its bytes), payload."""
    SENT = 2
    """A payload went out: stream (text), peer (text; its bytes), payload."""
    TICK = 3
    """A turn of the robot side, after its STATE and FRAME: applied f64, when the command was sent that moves the arm,
    on the operator side's clock, NaN for none."""
    STATE = 4
    """What the arm measured (robot_side/recording/inputs.py), where it is not what it was in the tick before."""
    FRAME = 5
    """What the camera saw (the same file), where it is not what it was in the tick before."""
    SEEN = 6
    """The operator side got a view payload; those longer than a control payload go elsewhere, as no core heeds them."""
    REPORT = 7
    """An input report of a DualSense, in recordings made before HANDS."""
    CALIBRATED = 8
    """The controller's travel, as JSON."""
    FOUND = 9
    """A controller was found."""
    LOST = 10
    """The controller was lost."""
    MOTION = 11
    """The operator side was asked what to send; what it sent follows as SENT."""
    OUTPUT = 12
    """It was asked what to tell the controller; what it told follows as TOLD, in earlier recordings as WRITTEN."""
    WRITTEN = 13
    """An output report for a DualSense on USB, in recordings made before TOLD."""
    STOPPED = 14
    """The emergency stop was pressed away from the controller."""
    TUNED = 15
    """A wish for other settings of the run, as JSON."""
    WATCHED = 16
    """The operator side told what it looks at, under the next of its core's sequence numbers."""
    HANDS = 17
    """The controller's state (operator_side/controller/state.py), in MessagePack."""
    TOLD = 18
    """What the controller was told to let feel (operator_side/controller/feel.py), in MessagePack."""


class Entry(NamedTuple):
    """One thing that happened."""

    kind: int
    now_s: float
    """On the side's monotonic clock, as its core was given it"""
    content: bytes


@dataclass(frozen=True)
class Block:
    """Some entries of one side, in order."""

    number: int
    dropped: int
    """Blocks of this side that were dropped before this one, over the run"""
    first_s: float
    last_s: float
    entries: bytes

    def unpacked(self) -> Iterator[Entry]:
        """Read its entries; ValueError where it is no block of ours."""
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
    """One entry as bytes."""
    content = b"".join(parts)
    return _ENTRY.pack(kind, len(content), now_s) + content


def pack_block(number: int, dropped: int, first_s: float, last_s: float, entries: bytes) -> bytes:
    """One block as bytes."""
    return _BLOCK.pack(number, dropped, first_s, last_s) + entries


def unpack_block(content: bytes) -> Block:
    """The block that `pack_block` made; ValueError for what is none."""
    if len(content) < _BLOCK.size:
        raise ValueError(f"a block of {len(content)} bytes; valid: {_BLOCK.size} or more")
    number, dropped, first_s, last_s = _BLOCK.unpack_from(content)
    return Block(number, dropped, first_s, last_s, content[_BLOCK.size :])


def text(value: bytes) -> bytes:
    """A short text before bytes."""
    return bytes([len(value)]) + value


def split_text(content: bytes) -> tuple[bytes, bytes]:
    """The short text and what follows it; ValueError where it ends within."""
    if not content or len(content) < 1 + content[0]:
        raise ValueError("a text that ends within itself")
    return content[1 : 1 + content[0]], content[1 + content[0] :]
