"""The trigger effects that feelahead commands, as values, and the exact eleven bytes of each.

A trigger's mechanical travel is divided into ten zones, 0 where the finger starts, each with a strength of 0 (none)
to 8. A value encodes one of two official codes, so that no value can make a debug code. Sources: Nielk1's notes on
trigger effects, revision 6; dualsensectl has the same.
"""

from dataclasses import dataclass
from typing import ClassVar, Final, final

ZONE_COUNT: Final = 10
MAX_STRENGTH: Final = 8
EFFECT_LENGTH: Final = 11
"""Bytes of one encoded effect: the code and ten parameters."""
DEBUG_CODES: Final = frozenset({0xFC, 0xFD, 0xFE})
"""Never to reach a controller: they corrupt a trigger until it is reset."""
_OFF_CODE: Final = 0x05
_FEEDBACK_CODE: Final = 0x21
COMMANDED_CODES: Final = frozenset({_OFF_CODE, _FEEDBACK_CODE})
"""The codes that a report to a controller may hold."""
_NO_ZONES: Final = (0,) * ZONE_COUNT


@final
@dataclass(frozen=True, slots=True)
class Off:
    """The trigger's own spring and nothing else."""

    zone_strengths: ClassVar[tuple[int, ...]] = _NO_ZONES

    def encode(self) -> bytes:
        """The code and ten zeros."""
        return bytes((_OFF_CODE,)).ljust(EFFECT_LENGTH, b"\0")


@final
@dataclass(frozen=True, slots=True)
class MultiPositionFeedback:
    """A resistance for each zone."""

    zone_strengths: tuple[int, ...]
    """Ten strengths, 0 to 8, the first for the zone where the finger starts; ten zeros encode as off."""

    def __post_init__(self) -> None:
        strengths = self.zone_strengths
        try:
            # Made at 1 kHz: `bytes` takes whole numbers only, and is quick.
            valid = isinstance(strengths, tuple) and max(bytes(strengths)) <= MAX_STRENGTH
        except (TypeError, ValueError):
            valid = False
        if not valid or len(strengths) != ZONE_COUNT:
            raise ValueError(
                f"zone_strengths = {strengths!r}; valid: a tuple of {ZONE_COUNT} whole numbers from 0 to {MAX_STRENGTH}"
            )

    def encode(self) -> bytes:
        """The code, a mask of the zones with a strength, and in three bits a zone the strength less one."""
        mask = fields = 0
        for zone, strength in enumerate(self.zone_strengths):
            if strength:
                mask |= 1 << zone
                fields |= (strength - 1) << (3 * zone)
        if not mask:
            return Off().encode()
        parameters = mask.to_bytes(2, "little") + fields.to_bytes(4, "little")
        return (bytes((_FEEDBACK_CODE,)) + parameters).ljust(EFFECT_LENGTH, b"\0")


@final
@dataclass(frozen=True, slots=True)
class OtherEffect:
    """An effect that another program told a virtual controller. It has no `encode`: it is shown and never sent."""

    zone_strengths: ClassVar[tuple[int, ...]] = _NO_ZONES
    """What holds against the finger is not simulated."""

    encoded: bytes


TriggerEffect = Off | MultiPositionFeedback
AnyEffect = TriggerEffect | OtherEffect


def decode_effect(encoded: bytes) -> AnyEffect:
    """Read the eleven bytes of an effect; `OtherEffect` for what no value here encodes to."""
    if encoded[0] == _FEEDBACK_CODE:
        mask, fields = int.from_bytes(encoded[1:3], "little"), int.from_bytes(encoded[3:7], "little")
        zones = range(ZONE_COUNT)
        effect: TriggerEffect = MultiPositionFeedback(
            tuple((fields >> (3 * zone) & 7) + 1 if mask >> zone & 1 else 0 for zone in zones)
        )
    else:
        effect = Off()
    return effect if effect.encode() == encoded else OtherEffect(encoded)
