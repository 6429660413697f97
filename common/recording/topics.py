"""The topics of a recording, and the JSON schemas that Foxglove plots by."""

from typing import Any, Final

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
