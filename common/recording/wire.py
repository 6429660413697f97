"""What a side tells its recorder, and the recorder the side, over a channel: one kind of byte, then its content.

And the topics of the file that the recorder makes of it, with the JSON schemas that Foxglove plots by.
"""

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


ENCODING: Final = "x-feelahead"
"""The encoding of what is ours and binary: blocks of entries (common/recording/entries.py), and view payloads."""
PROFILE: Final = "feelahead"
FORMAT: Final = 1
"""Grows with a change that an older reader would misread."""
BINARY: Final = {"/robot/inputs": "feelahead.Block", "/operator/inputs": "feelahead.Block", "/view": "feelahead.View"}
"""Topics of bytes, with the names of their schemas."""
_USUAL: Final[dict[str, dict[str, Any]]] = {
    "/overlap": {"objects": [{"object": "post", "l2_mm3": 0.0, "r2_mm3": 0.0}]},
    "/telemetry": {"target": "post"},
    "/robot/status": {"stopped_because": "a gap", "nearest": "post", "target": "post"},
}
"""Values of fields that are empty in a first message."""


def schema_of(topic: str, first: dict[str, Any]) -> dict[str, Any]:
    """The schema of a topic of JSON, by its first message; later ones may hold more."""
    return {"title": f"feelahead.{topic.title().replace('/', '')}", **_type_of(first | _USUAL.get(topic, {}))}


def _type_of(value: Any) -> dict[str, Any]:
    """The type of a value as JSON Schema says it; what is null is mostly a number that is not known yet."""
    match value:
        case dict():
            return {"type": "object", "properties": {name: _type_of(one) for name, one in value.items()}}
        case list():
            return {"type": "array", "items": _type_of(value[0] if value else None)}
        case None:
            return {"type": ["number", "null"]}
        case bool():
            return {"type": "boolean"}
    return {"type": "string" if isinstance(value, str) else "number"}
