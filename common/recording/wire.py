"""What a side tells its recorder, and the recorder the side, over a channel: one kind of byte, then its content."""

import struct
from typing import Any, Final

import msgspec

HEADER: Final = b"H"
"""Who records: JSON, once and first"""
BLOCK: Final = b"B"
"""A block of entries"""
VIEW: Final = b"V"
"""now f64, and a view payload"""
STATUS: Final = b"S"
"""now f64, and the side's status as JSON"""
FACTS: Final = b"F"
"""now f64, and OperatorFacts as JSON"""
NOTE: Final = b"N"
"""now f64, and a line of text for people"""
END: Final = b"E"
"""The sender is through; the answer is what was kept, with `ended`"""

_NOW: Final = struct.Struct("<d")


def stamped(now_s: float) -> bytes:
    """The stamp before what happened then."""
    return _NOW.pack(now_s)


def unstamped(content: bytes) -> tuple[float, bytes]:
    """The stamp and what follows; ValueError for too few bytes."""
    if len(content) < _NOW.size:
        raise ValueError("a message without its stamp")
    return _NOW.unpack_from(content)[0], content[_NOW.size :]


def as_json(values: Any) -> bytes:
    """What people can read; numbers that are not finite become null, as JSON knows none."""
    return msgspec.json.encode(values, enc_hook=str)
