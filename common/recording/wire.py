"""Messages between a side and its recorder: one byte for the kind, then the content.

Also encodings of the file's topics; topics.py has the types of those in JSON.
"""

import struct
from typing import Any, Final

import msgspec

HEADER: Final = b"H"
"""Kind of message: header of the side that is recorded, as JSON; sent once, before all others"""
BLOCK: Final = b"B"
"""Kind of message: block of entries (entries.py)"""
VIEW: Final = b"V"
"""Kind of message: time f64, then a view payload"""
STATUS: Final = b"S"
"""Kind of message: time f64, then the side's status as JSON"""
SCHEMA: Final = b"T"
"""Kind of message: JSON schema of the FACTS that follow"""
FACTS: Final = b"F"
"""Kind of message: time f64, then OperatorFacts as JSON"""
NOTE: Final = b"N"
"""Kind of message: time f64, then a line of text for people"""
END: Final = b"E"
"""Kind of message: the sender sends no more; the recorder answers with the file's figures and `ended`"""

_NOW: Final = struct.Struct("<d")


def stamped(now_s: float) -> bytes:
    """Pack the time that precedes a message's content."""
    return _NOW.pack(now_s)


def unstamped(content: bytes) -> tuple[float, bytes]:
    """Split `content` into the time and the rest; raises ValueError for too few bytes."""
    if len(content) < _NOW.size:
        raise ValueError("the message is too short to hold its time")
    return _NOW.unpack_from(content)[0], content[_NOW.size :]


def as_json(values: Any) -> bytes:
    """Encode `values` as JSON; numbers that are not finite become null."""
    return msgspec.json.encode(values, enc_hook=str)


ENCODING: Final = "x-feelahead"
"""Name of the encoding of our binary topics: blocks of entries (common/recording/entries.py), and view payloads."""
PROFILE: Final = "feelahead"
FORMAT: Final = 1
"""Version of the recording's format; it grows with each change that an older reader would misread."""
BINARY: Final = {"/robot/inputs": "feelahead.Block", "/operator/inputs": "feelahead.Block", "/view": "feelahead.View"}
"""Name of the schema of each binary topic, keyed by topic."""
