"""Large view messages in pieces: `number, offset, total` (u32 each, little-endian), then bytes.

The topic of a piece is the whole's with `.piece` behind it, which a subscription to the whole's receives, too.
"""

import struct
from dataclasses import dataclass, field
from typing import Final

PIECE: Final = b".piece"
"""Behind the topic of a piece."""
_HEAD: Final = struct.Struct("<III")
HEAD_BYTES: Final = _HEAD.size
LEAST_BYTES: Final = 128
"""Only the last piece of a whole is shorter, so that no flood of crumbs fills our memory."""
_UNDER_WAY: Final = 2
"""Wholes that are put together at once; the one begun first is forgotten for a third."""


def piece_of(whole: bytes, number: int, offset: int, size_bytes: int) -> bytes:
    """Make the piece of `whole` that begins at `offset`; `number` tells wholes apart, modulo 2**32."""
    return _HEAD.pack(number & 0xFFFFFFFF, offset, len(whole)) + whole[offset : offset + size_bytes]


@dataclass
class _Whole:
    total_bytes: int
    have_bytes: int = 0
    parts: dict[int, bytes] = field(default_factory=dict)


class Joining:
    """Puts the pieces of one topic together, in any order; memory is bounded by twice `limit_bytes`."""

    def __init__(self, limit_bytes: int) -> None:
        """limit_bytes: of a whole."""
        self.rejected = 0
        """Pieces that fit no whole."""
        self.incomplete = 0
        """Wholes of which something was lost."""
        self._limit_bytes = limit_bytes
        self._begun: dict[int, _Whole] = {}

    def take(self, piece: bytes) -> bytes | None:
        """Take one piece; the whole, if it was the last one missing."""
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
                # They overlap: nobody knows which one is right.
                self.rejected += 1
                return None
            at += len(parts[offset])
        return b"".join(parts[offset] for offset in sorted(parts))
