"""Trigger effects that feelahead commands: strengths of ten zones, encoded exactly in eleven bytes.

Strengths are encoded with one of two official effect codes, never with a debug code. Sources: Nielk1's notes on
trigger effects, revision 6; dualsensectl has the same.
"""

from typing import Final

from operator_side.controller.feel import FREE_TRIGGER, ZONE_COUNT, Strengths

EFFECT_LENGTH: Final = 11
"""Length of an encoded effect, in bytes: the code and ten parameters."""
DEBUG_CODES: Final = frozenset({0xFC, 0xFD, 0xFE})
"""Effect codes that must never reach a controller, as they corrupt a trigger until it is reset"""
_OFF_CODE: Final = 0x05
_FEEDBACK_CODE: Final = 0x21
COMMANDED_CODES: Final = frozenset({_OFF_CODE, _FEEDBACK_CODE})
"""Only effect codes that a report to a controller may contain: off, and feedback"""


def encode_effect(strengths: Strengths) -> bytes:
    """Encode strengths: effect code, bit mask of the stiff zones, and three bits for each zone's strength minus 1.

    Strengths that are all 0 are encoded as the effect `off`.
    """
    mask = fields = 0
    for zone, strength in enumerate(strengths):
        if strength:
            mask |= 1 << zone
            fields |= (strength - 1) << (3 * zone)
    parameters = mask.to_bytes(2, "little") + fields.to_bytes(4, "little")
    return (bytes((_FEEDBACK_CODE if mask else _OFF_CODE,)) + parameters).ljust(EFFECT_LENGTH, b"\0")


def decode_effect(encoded: bytes) -> Strengths | None:
    """Decode the eleven bytes of an effect; None for an effect that `encode_effect` never makes."""
    strengths = FREE_TRIGGER
    if encoded[0] == _FEEDBACK_CODE:
        mask, fields = int.from_bytes(encoded[1:3], "little"), int.from_bytes(encoded[3:7], "little")
        strengths = tuple((fields >> (3 * zone) & 7) + 1 if mask >> zone & 1 else 0 for zone in range(ZONE_COUNT))
    return strengths if encode_effect(strengths) == encoded else None
