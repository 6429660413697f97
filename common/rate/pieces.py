"""Large view messages (wholes), split into pieces: `number, offset, total` (u32 each, little-endian), then the bytes.

The topic of a piece is the topic of the whole plus `.piece`. So a subscription to the topic receives the pieces, too.
"""

import struct
from dataclasses import dataclass, field
from typing import Final

PIECE: Final = b".piece"
"""Suffix of the topic of a piece."""
_HEAD: Final = struct.Struct("<III")
HEAD_BYTES: Final = _HEAD.size
LEAST_BYTES: Final = 128
"""Least content of a piece in bytes, except for the last of a whole: a flood of tiny pieces must not fill our
memory."""
_UNDER_WAY: Final = 2
"""Maximum number of incomplete wholes; when a third begins, the first is forgotten."""


def piece_of(whole: bytes, number: int, offset: int, size_bytes: int) -> bytes:
    """Make the piece of `size_bytes` of `whole` that begins at `offset`; `number` modulo 2**32 identifies `whole`."""
    return _HEAD.pack(number & 0xFFFFFFFF, offset, len(whole)) + whole[offset : offset + size_bytes]


@dataclass
class _Whole:
    total_bytes: int
    have_bytes: int = 0
    parts: dict[int, bytes] = field(default_factory=dict)


class Joining:
    """Joiner of the pieces of one topic, which may arrive in any order; memory is bounded by twice `limit_bytes`."""

    def __init__(self, limit_bytes: int) -> None:
        """limit_bytes: largest valid size of a whole."""
        self.rejected = 0
        """Number of invalid pieces, and of wholes with overlapping pieces."""
        self.incomplete = 0
        """Number of wholes forgotten before all of their pieces had arrived."""
        self._limit_bytes = limit_bytes
        self._begun: dict[int, _Whole] = {}

    def add(self, piece: bytes) -> bytes | None:
        """Add one piece; return the whole message if this piece completes it, else None."""
        if len(piece) <= HEAD_BYTES:
            self.rejected += 1
            return None
        number, offset, total = _HEAD.unpack_from(piece)
        content = piece[HEAD_BYTES:]
        whole = self._begun.get(number) or _Whole(total)
        end = offset + len(content)
        crumb = len(content) < LEAST_BYTES and end != total
        if total != whole.total_bytes or not end <= total <= self._limit_bytes or crumb:
            self.rejected += 1
            return None
        if offset in whole.parts:
            return None
        whole.parts[offset] = content
        whole.have_bytes += len(content)
        if whole.have_bytes < total:
            self._begun[number] = whole
            if len(self._begun) > _UNDER_WAY:
                del self._begun[next(iter(self._begun))]
                self.incomplete += 1
            return None
        self._begun.pop(number, None)
        return self._joined(whole.parts)

    def _joined(self, parts: dict[int, bytes]) -> bytes | None:
        at = 0
        for offset in sorted(parts):
            if offset != at:
                # They overlap, and either may be right.
                self.rejected += 1
                return None
            at += len(parts[offset])
        return b"".join(parts[offset] for offset in sorted(parts))
