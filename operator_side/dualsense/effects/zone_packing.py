"""How the parameters of a trigger effect are packed into its eleven bytes: zones, three bits each, and a code.

Byte layout: Nielk1's notes on trigger effects, revision 6.
"""

from collections.abc import Sequence
from typing import Final

from common.errors import RemoteProtocolError

ZONE_COUNT: Final = 10
MAX_STRENGTH: Final = 8
EFFECT_LENGTH: Final = 11
"""Bytes of one encoded effect: the code and ten parameters."""
NO_ZONES: Final = (0,) * ZONE_COUNT
_FREQUENCY_AT: Final = 9


def packed(code: int, *parameters: int) -> bytes:
    """The code, its parameters and zeros: 11 bytes."""
    return bytes([code, *parameters]).ljust(EFFECT_LENGTH, b"\0")


def pack_zones(code: int, strengths: Sequence[int], frequency_hz: int = 0) -> bytes:
    """A mask of the zones that have a strength, and in three bits a zone the strength less one."""
    mask = fields = 0
    for zone, strength in enumerate(strengths):
        if strength > 0:
            mask |= 1 << zone
            fields |= (strength - 1) << (3 * zone)
    encoded = bytearray(packed(code, *mask.to_bytes(2, "little"), *fields.to_bytes(4, "little")))
    encoded[_FREQUENCY_AT] = frequency_hz
    return bytes(encoded)


def unpack_zones(encoded: bytes) -> tuple[tuple[int, ...], int]:
    """The ten strengths and the frequency in Hz of what `pack_zones` made."""
    mask = int.from_bytes(encoded[1:3], "little")
    fields = int.from_bytes(encoded[3:7], "little")
    strengths = tuple((fields >> (3 * zone) & 7) + 1 if mask >> zone & 1 else 0 for zone in range(ZONE_COUNT))
    return strengths, encoded[_FREQUENCY_AT]


def one_step(strengths: tuple[int, ...]) -> tuple[int, int]:
    """(the first zone, the strength) of the one-step profile that ends as `strengths` do."""
    return min(strengths.count(0), ZONE_COUNT - 1), strengths[-1]


def stepped(position: int, strength: int) -> tuple[int, ...]:
    """One strength from a zone to the end of the travel."""
    return (0,) * position + (strength,) * (ZONE_COUNT - position)


def between(start: int, end: int, strength: int) -> tuple[int, ...]:
    """One strength from the zone `start` up to, and without, the zone `end`."""
    return (0,) * start + (strength,) * (end - start) + (0,) * (ZONE_COUNT - end)


def pack_ends(start: int, end: int) -> tuple[int, int]:
    """The two bytes of a mask with the first and the last zone."""
    mask = 1 << start | 1 << end
    return mask & 0xFF, mask >> 8


def unpack_ends(encoded: bytes) -> tuple[int, int]:
    """The first and the last zone; RemoteProtocolError unless the mask has two bits."""
    mask = int.from_bytes(encoded[1:3], "little")
    if mask.bit_count() != 2:
        raise stray(encoded)
    return (mask & -mask).bit_length() - 1, mask.bit_length() - 1


def stray(encoded: bytes) -> RemoteProtocolError:
    """The error for bits that no value packs."""
    return RemoteProtocolError(f"a trigger effect with stray bits: {encoded.hex(' ')}")
