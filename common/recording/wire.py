"""Messages between a side and its recorder: one byte for the kind, then the content.

Also encodings and schemas of the file's topics; Foxglove needs the JSON schemas to plot the values.
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
        raise ValueError("a message without its stamp")
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
_USUAL: Final[dict[str, dict[str, Any]]] = {
    "/overlap": {"objects": [{"object": "post", "l2_mm3": 0.0, "r2_mm3": 0.0}]},
    "/telemetry": {"target": "post"},
    "/robot/status": {"stopped_because": "a gap", "nearest": "post", "target": "post"},
}
"""Example values, keyed by topic, from which a schema is inferred where the first message has empty fields."""


def schema_of(topic: str, first: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON schema of a topic, inferred from its first message; later messages may have further fields."""
    return {"title": f"feelahead.{topic.title().replace('/', '')}", **_type_of(first | _USUAL.get(topic, {}))}


def _type_of(value: Any) -> dict[str, Any]:
    """Return the type of `value` in JSON Schema; None counts as a number that is still unknown."""
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
