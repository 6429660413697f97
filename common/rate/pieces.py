"""Large view messages in pieces: `number, offset, total` (u32 each, little-endian), then bytes.

The topic of a piece is the whole's plus `.piece`, so that a subscription to the whole's receives it, too.
"""

import struct
from dataclasses import dataclass, field
from typing import Final

PIECE: Final = b".piece"
"""End of a piece's topic."""
_HEAD: Final = struct.Struct("<III")
HEAD_BYTES: Final = _HEAD.size
LEAST_BYTES: Final = 128
"""Least bytes of a piece, except the last of a whole: a flood of tiny pieces must not fill our memory."""
_UNDER_WAY: Final = 2
"""Number of wholes that are joined at once; the one begun first is forgotten for a third."""


def piece_of(whole: bytes, number: int, offset: int, size_bytes: int) -> bytes:
    """Make the piece of `whole` that begins at `offset`; `number` identifies the whole, modulo 2**32."""
    return _HEAD.pack(number & 0xFFFFFFFF, offset, len(whole)) + whole[offset : offset + size_bytes]


@dataclass
class _Whole:
    total_bytes: int
    have_bytes: int = 0
    parts: dict[int, bytes] = field(default_factory=dict)


class Joining:
    """Joiner of one topic's pieces, in any order; memory is bounded by twice `limit_bytes`."""

    def __init__(self, limit_bytes: int) -> None:
        """limit_bytes: largest size of a message."""
        self.rejected = 0
        """Number of pieces that belong to no message."""
        self.incomplete = 0
        """Number of messages with a lost piece."""
        self._limit_bytes = limit_bytes
        self._begun: dict[int, _Whole] = {}

    def take(self, piece: bytes) -> bytes | None:
        """Add one piece; return the whole if it is complete now."""
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
