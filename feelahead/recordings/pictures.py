"""The pictures of one camera in a recording."""

import struct
from typing import Final, NamedTuple

from common.recording.images import read_image
from common.recording.reading import Recording

_NANOSECONDS: Final = 1e-9
_START_OF_FRAME: Final = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})


class Picture(NamedTuple):
    """One of them."""

    time_s: float
    """Since the recording began"""
    jpeg: bytes
    width: int
    height: int


def pictures(recording: Recording, view: str) -> list[Picture]:
    """All that a camera took, in order."""
    first_ns = recording.began_ns()
    found = []
    for message in recording.messages([f"/camera/{view}"]):
        jpeg = read_image(message.content).jpeg
        width, height = picture_size(jpeg)
        found.append(Picture(_NANOSECONDS * (message.log_ns - first_ns), jpeg, width, height))
    return found


def picture_size(jpeg: bytes) -> tuple[int, int]:
    """Width and height as a JPEG's head says them; ValueError for what has none."""
    position = 2
    while position + 9 <= len(jpeg) and jpeg[position] == 0xFF:
        marker, (length,) = jpeg[position + 1], struct.unpack_from(">H", jpeg, position + 2)
        if marker in _START_OF_FRAME:
            height, width = struct.unpack_from(">HH", jpeg, position + 5)
            return width, height
        position += 2 + length
    raise ValueError("no JPEG with a size")
