"""Recorded inputs and outputs of a core, as entries in blocks of bytes: all that a replay needs.

A block is one message of the file. All numbers are little-endian:

    block   number u32, dropped u32, first f64, last f64, then entries
    entry   kind u8, length u32, now f64, then `length` bytes

`number` counts the blocks of one side from 0. A missing block was dropped because the recorder did not keep up;
`dropped` counts such blocks up to this one. `first` and `last` are the times of the first and last entry, in seconds on
the side's monotonic clock.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

_BLOCK: Final = struct.Struct("<IIdd")
_ENTRY: Final = struct.Struct("<BId")
FRAME: Final = struct.Struct("<dB")
"""Beginning of a FRAME: its time, and flags"""
HAS_UNKNOWN: Final = 16
"""Flag of frames in which SHARES come next"""
SHARES: Final = struct.Struct("<5d")
"""Shares of the space ahead, left, right, above and below the gripper that nobody has seen"""


class Kind(IntEnum):
    """Kind of an entry, with its content. A text is a length (u8) and so many bytes of UTF-8."""

    RECEIVED = 1
    """A control payload was received: peer (packed like a text), payload."""
    SENT = 2
    """A payload was sent: stream (text), peer (packed like a text), payload."""
    TICK = 3
    """A turn of the robot side, after its STATE and FRAME. Content: f64, stamp, on the operator side's clock, of the
    command that moves the arm; NaN for none."""
    STATE = 4
    """The arm's measurement (robot_side/recording/arm_states.py), if it differs from that of the previous tick."""
    FRAME = 5
    """The camera's frame (robot_side/recording/frames.py), if it differs from that of the previous tick."""
    SEEN = 6
    """The operator side received a view payload that a control message could hold, such as Telemetry. Longer ones,
    which no core uses, are recorded only as messages of kind VIEW (wire.py)."""
    CALIBRATED = 8
    """Calibration of the travel of the controller's triggers, as JSON."""
    FOUND = 9
    """A controller was found."""
    LOST = 10
    """The controller was lost."""
    MOTION = 11
    """The operator side's core was asked for messages to send; they follow as SENT."""
    OUTPUT = 12
    """The operator side's core was asked for the controller's effects; they follow as TOLD."""
    STOPPED = 14
    """The emergency stop was pressed elsewhere than on the controller, as on a page."""
    TUNED = 15
    """Changes of the run's settings that the operator requests, as JSON."""
    WATCHED = 16
    """The operator side sent a Watch, which took the core's next sequence number."""
    HANDS = 17
    """The controller's state (operator_side/controller/state.py), in MessagePack."""
    TOLD = 18
    """The effects sent to the controller (operator_side/controller/feel.py), in MessagePack."""
    EPISODE = 19
    """A mark of an episode counts (EpisodeMark of common/episode.py), as JSON; follows from other inputs."""
    MARKED = 20
    """A mark was made away from the controller, as JSON."""
    TRUTH = 21
    """What is true in the simulation (Truth of topics.py), as JSON; no core takes it."""


class Entry(NamedTuple):
    """One input or output of a side's core, as recorded: its kind, time and bytes."""

    kind: int
    now_s: float
    """Time on the side's monotonic clock, as passed to the core"""
    content: bytes


@dataclass(frozen=True)
class Block:
    """Block of one side's successive entries."""

    number: int
    dropped: int
    """Number of this side's blocks that were dropped before this one, over the run"""
    first_s: float
    last_s: float
    entries: bytes

    def unpacked(self) -> Iterator[Entry]:
        """Yield the block's entries; raises ValueError if the block is invalid."""
        position, end = 0, len(self.entries)
        while position < end:
            if end - position < _ENTRY.size:
                raise ValueError("the block is cut off within an entry")
            kind, length, now_s = _ENTRY.unpack_from(self.entries, position)
            position += _ENTRY.size
            if end - position < length:
                raise ValueError("the block is cut off within an entry")
            yield Entry(kind, now_s, self.entries[position : position + length])
            position += length


def entry(kind: Kind, now_s: float, *parts: bytes) -> bytes:
    """Pack one entry, whose content is the concatenation of `parts`."""
    content = b"".join(parts)
    return _ENTRY.pack(kind, len(content), now_s) + content


def pack_block(number: int, dropped: int, first_s: float, last_s: float, entries: bytes) -> bytes:
    """Pack one block."""
    return _BLOCK.pack(number, dropped, first_s, last_s) + entries


def unpack_block(content: bytes) -> Block:
    """Unpack what `pack_block` packed; raises ValueError if `content` is invalid."""
    if len(content) < _BLOCK.size:
        raise ValueError(f"the block has {len(content)} bytes; valid: {_BLOCK.size} or more")
    number, dropped, first_s, last_s = _BLOCK.unpack_from(content)
    return Block(number, dropped, first_s, last_s, content[_BLOCK.size :])


def text(value: bytes) -> bytes:
    """Pack a text of at most 255 bytes with its length, so that other bytes can follow it."""
    return bytes([len(value)]) + value


def split_text(content: bytes) -> tuple[bytes, bytes]:
    """Return a text packed by `text`, and the bytes after it; raises ValueError if the text is cut off."""
    if not content or len(content) < 1 + content[0]:
        raise ValueError("the text is cut off before its stated length")
    return content[1 : 1 + content[0]], content[1 + content[0] :]
