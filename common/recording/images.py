"""Camera pictures in a recording: Foxglove's CompressedImage messages, decoded without a protobuf compiler."""

from typing import Final, NamedTuple

_DATA: Final = 2
_FRAME_ID: Final = 4
_BYTES: Final = 2


class Image(NamedTuple):
    """One camera picture of a view."""

    view: str
    jpeg: bytes


def read_image(content: bytes) -> Image:
    """Decode a CompressedImage in protobuf's encoding; raises ValueError if it is invalid."""
    fields = _fields(content)
    if _DATA not in fields:
        raise ValueError("a picture without its data")
    return Image(fields.get(_FRAME_ID, b"").decode(), fields[_DATA])


def _fields(content: bytes) -> dict[int, bytes]:
    """Return the protobuf fields of `content`, keyed by number. All must be byte fields, as a CompressedImage's are."""
    found: dict[int, bytes] = {}
    position = 0
    while position < len(content):
        key, position = _number(content, position)
        if key & 7 != _BYTES:
            raise ValueError(f"a field of kind {key & 7}; valid: {_BYTES}")
        length, position = _number(content, position)
        if position + length > len(content):
            raise ValueError("a field that ends beyond its message")
        found[key >> 3] = content[position : position + length]
        position += length
    return found


def _number(content: bytes, position: int) -> tuple[int, int]:
    value = shift = 0
    while position < len(content):
        byte = content[position]
        position += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, position
        shift += 7
    raise ValueError("a number that ends beyond its message")
