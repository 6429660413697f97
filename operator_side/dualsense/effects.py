"""Trigger effects as values: what may be asked of an adaptive trigger, and its exact eleven bytes.

A trigger's mechanical travel is divided into ten zones, 0 where the finger starts, each with a resistance of
0 (none) to 8. Byte layout: Nielk1's notes on trigger effects, revision 6. A value here can encode no code but
the two below, so that the debug codes, which corrupt a trigger until it is reset, cannot be made at all.
"""

from dataclasses import dataclass
from typing import ClassVar, Final, final

from common.errors import RemoteProtocolError

ZONE_COUNT: Final = 10
MAX_STRENGTH: Final = 8
EFFECT_LENGTH: Final = 11
"""Bytes of one encoded effect: the code and ten parameters."""
DEBUG_CODES: Final = frozenset({0xFC, 0xFD, 0xFE})
"""Never to reach a controller."""

_OFF_CODE = 0x05
_FEEDBACK_CODE = 0x21


def _check_integer(name: str, value: int, highest: int) -> None:
    if not isinstance(value, int) or not 0 <= value <= highest:
        raise ValueError(f"{name} = {value}; valid: an integer from 0 to {highest}")


def _encode_feedback(strengths: tuple[int, ...]) -> bytes:
    """Pack a zone mask and three bits a zone, which hold the strength less one; nothing to resist is off."""
    mask = packed = 0
    for zone, strength in enumerate(strengths):
        if strength > 0:
            mask |= 1 << zone
            packed |= (strength - 1) << (3 * zone)
    if mask == 0:
        return Off().encode()
    return bytes([_FEEDBACK_CODE]) + mask.to_bytes(2, "little") + packed.to_bytes(4, "little") + bytes(4)


@final
@dataclass(frozen=True, slots=True)
class Off:
    """The trigger's own spring and nothing else."""

    zone_strengths: ClassVar[tuple[int, ...]] = (0,) * ZONE_COUNT

    def encode(self) -> bytes:
        """The code and ten zeros."""
        return bytes([_OFF_CODE]) + bytes(EFFECT_LENGTH - 1)


@final
@dataclass(frozen=True, slots=True)
class Feedback:
    """One resistance from a zone to the end of the travel."""

    position: int
    """The first zone that resists, 0 to 9."""
    strength: int
    """0 to 8; 0 encodes as off."""

    def __post_init__(self) -> None:
        _check_integer("position", self.position, ZONE_COUNT - 1)
        _check_integer("strength", self.strength, MAX_STRENGTH)

    @property
    def zone_strengths(self) -> tuple[int, ...]:
        """The resistance of each of the ten zones, 0 to 8."""
        return (0,) * self.position + (self.strength,) * (ZONE_COUNT - self.position)

    def encode(self) -> bytes:
        """The code, the zone mask and the packed strengths: 11 bytes."""
        return _encode_feedback(self.zone_strengths)


@final
@dataclass(frozen=True, slots=True)
class MultiPositionFeedback:
    """A resistance for each zone."""

    strengths: tuple[int, ...]
    """Ten strengths, 0 to 8, the first for the zone where the finger starts; ten zeros encode as off."""

    def __post_init__(self) -> None:
        if len(self.strengths) != ZONE_COUNT:
            raise ValueError(f"strengths has {len(self.strengths)} values; valid: {ZONE_COUNT}")
        for zone, strength in enumerate(self.strengths):
            _check_integer(f"strengths[{zone}]", strength, MAX_STRENGTH)

    @property
    def zone_strengths(self) -> tuple[int, ...]:
        """The resistance of each of the ten zones, 0 to 8."""
        return self.strengths

    def encode(self) -> bytes:
        """The code, the zone mask and the packed strengths: 11 bytes."""
        return _encode_feedback(self.strengths)


TriggerEffect = Off | Feedback | MultiPositionFeedback


def decode_effect(encoded: bytes) -> TriggerEffect:
    """Read the eleven bytes that `encode` makes; whatever decodes, encodes to the same bytes again.

    The bytes of a one-step profile are those of `Feedback`, so that is what they decode to, whichever value
    made them. RemoteProtocolError for another length or code, and for stray bits outside the packing.
    """
    if len(encoded) != EFFECT_LENGTH:
        raise RemoteProtocolError(f"a trigger effect of {len(encoded)} bytes; valid: {EFFECT_LENGTH}")
    effect: TriggerEffect
    if encoded[0] == _OFF_CODE:
        effect = Off()
    elif encoded[0] == _FEEDBACK_CODE:
        effect = _decode_feedback(encoded)
    else:
        raise RemoteProtocolError(
            f"trigger effect code 0x{encoded[0]:02x}; valid: 0x{_OFF_CODE:02x} and 0x{_FEEDBACK_CODE:02x}"
        )
    if effect.encode() != encoded:
        raise RemoteProtocolError(f"a trigger effect with stray bits: {encoded.hex(' ')}")
    return effect


def _decode_feedback(encoded: bytes) -> Feedback | MultiPositionFeedback:
    mask = int.from_bytes(encoded[1:3], "little")
    packed = int.from_bytes(encoded[3:7], "little")
    strengths = tuple(((packed >> (3 * zone)) & 7) + 1 if (mask >> zone) & 1 else 0 for zone in range(ZONE_COUNT))
    one_step = Feedback(position=min(strengths.count(0), ZONE_COUNT - 1), strength=strengths[-1])
    return one_step if one_step.zone_strengths == strengths else MultiPositionFeedback(strengths)
