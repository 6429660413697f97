"""Messages between a side and its recorder: one byte for the kind, then the content.

Also the topics of the recorder's file, with the JSON schemas by which Foxglove plots.
"""

import struct
from typing import Any, Final

import msgspec

HEADER: Final = b"H"
"""Header of the recording side: JSON, once and first"""
BLOCK: Final = b"B"
"""Block of entries"""
VIEW: Final = b"V"
"""now f64, and a view payload"""
STATUS: Final = b"S"
"""now f64, and the side's status as JSON"""
FACTS: Final = b"F"
"""now f64, and OperatorFacts as JSON"""
NOTE: Final = b"N"
"""now f64, and a line of text for people"""
END: Final = b"E"
"""End of the sender; the answer is the file's figures, with `ended`"""

_NOW: Final = struct.Struct("<d")


def stamped(now_s: float) -> bytes:
    """Pack the stamp that precedes a content."""
    return _NOW.pack(now_s)


def unstamped(content: bytes) -> tuple[float, bytes]:
    """Split off the stamp; raises ValueError for too few bytes."""
    if len(content) < _NOW.size:
        raise ValueError("a message without its stamp")
    return _NOW.unpack_from(content)[0], content[_NOW.size :]


def as_json(values: Any) -> bytes:
    """Encode as JSON; numbers that are not finite become null."""
    return msgspec.json.encode(values, enc_hook=str)


ENCODING: Final = "x-feelahead"
"""Encoding of our binary topics: blocks of entries (common/recording/entries.py), and view payloads."""
PROFILE: Final = "feelahead"
FORMAT: Final = 1
"""Version of the format; grows with a change that an older reader would misread."""
BINARY: Final = {"/robot/inputs": "feelahead.Block", "/operator/inputs": "feelahead.Block", "/view": "feelahead.View"}
"""Binary topics, with the names of their schemas."""
_USUAL: Final[dict[str, dict[str, Any]]] = {
    "/overlap": {"objects": [{"object": "post", "l2_mm3": 0.0, "r2_mm3": 0.0}]},
    "/telemetry": {"target": "post"},
    "/robot/status": {"stopped_because": "a gap", "nearest": "post", "target": "post"},
}
"""Example values, to infer a schema where a first message has empty fields."""


def schema_of(topic: str, first: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a JSON topic, by its first message; later ones may hold more."""
    return {"title": f"feelahead.{topic.title().replace('/', '')}", **_type_of(first | _USUAL.get(topic, {}))}


def _type_of(value: Any) -> dict[str, Any]:
    """Return a value's type in JSON Schema; null is taken for a number that is still unknown."""
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
