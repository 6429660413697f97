"""The official trigger effects that hold against the finger, and the one that does nothing.

A trigger's mechanical travel is divided into ten zones, 0 where the finger starts, each with a strength of 0
(none) to 8. Sources: Nielk1's notes on trigger effects, revision 6; dualsensectl has the same.
"""

from dataclasses import dataclass
from typing import ClassVar, Final, final

from common.checks import check_integer, check_integers
from operator_side.dualsense.effects.effect_codes import FEEDBACK_CODE, OFF_CODE, WEAPON_CODE
from operator_side.dualsense.effects.zone_packing import (
    MAX_STRENGTH,
    NO_ZONES,
    ZONE_COUNT,
    between,
    pack_ends,
    pack_zones,
    packed,
    stepped,
)

_LAST_ZONE: Final = ZONE_COUNT - 1


@final
@dataclass(frozen=True, slots=True)
class Off:
    """The trigger's own spring and nothing else."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    def encode(self) -> bytes:
        """The code and ten zeros."""
        return packed(OFF_CODE)


def _encode_feedback(strengths: tuple[int, ...]) -> bytes:
    """Nothing to resist is off."""
    return pack_zones(FEEDBACK_CODE, strengths) if any(strengths) else Off().encode()


@final
@dataclass(frozen=True, slots=True)
class Feedback:
    """One resistance from a zone to the end of the travel."""

    position: int
    """The first zone that resists, 0 to 9."""
    strength: int
    """0 to 8; 0 encodes as off."""

    def __post_init__(self) -> None:
        check_integer("position", self.position, 0, _LAST_ZONE)
        check_integer("strength", self.strength, 0, MAX_STRENGTH)

    @property
    def zone_strengths(self) -> tuple[int, ...]:
        """The resistance of each of the ten zones, 0 to 8."""
        return stepped(self.position, self.strength)

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
        check_integers("strengths", self.strengths, ZONE_COUNT, 0, MAX_STRENGTH)

    @property
    def zone_strengths(self) -> tuple[int, ...]:
        """The resistance of each of the ten zones, 0 to 8."""
        return self.strengths

    def encode(self) -> bytes:
        """The code, the zone mask and the packed strengths: 11 bytes."""
        return _encode_feedback(self.strengths)


@final
@dataclass(frozen=True, slots=True)
class SlopeFeedback:
    """A resistance that changes linearly from one zone to another, and then holds to the end of the travel."""

    start: int
    """The first zone that resists, 0 to 8."""
    end: int
    """Where the last strength is reached, start + 1 to 9."""
    start_strength: int
    """1 to 8."""
    end_strength: int
    """1 to 8."""

    def __post_init__(self) -> None:
        check_integer("start", self.start, 0, _LAST_ZONE - 1)
        check_integer("end", self.end, self.start + 1, _LAST_ZONE)
        check_integer("start_strength", self.start_strength, 1, MAX_STRENGTH)
        check_integer("end_strength", self.end_strength, 1, MAX_STRENGTH)

    @property
    def zone_strengths(self) -> tuple[int, ...]:
        """The resistance of each of the ten zones, 0 to 8; a half is rounded to the even strength."""
        rise, run = self.end_strength - self.start_strength, self.end - self.start
        slope = tuple(round(self.start_strength + rise * step / run) for step in range(run))
        return (0,) * self.start + slope + (self.end_strength,) * (ZONE_COUNT - self.end)

    def encode(self) -> bytes:
        """The code, the zone mask and the packed strengths: 11 bytes, those of the same multi-position feedback."""
        return _encode_feedback(self.zone_strengths)


@final
@dataclass(frozen=True, slots=True)
class Weapon:
    """A resistance between two zones that gives way at the second one, like a gun's trigger."""

    start: int
    """The first zone that resists, 2 to 7."""
    end: int
    """Where it gives way, start + 1 to 8."""
    strength: int
    """0 to 8; 0 encodes as off."""

    def __post_init__(self) -> None:
        check_integer("start", self.start, 2, 7)
        check_integer("end", self.end, self.start + 1, 8)
        check_integer("strength", self.strength, 0, MAX_STRENGTH)

    @property
    def zone_strengths(self) -> tuple[int, ...]:
        """The resistance of each of the ten zones before it has given way."""
        return between(self.start, self.end, self.strength)

    def encode(self) -> bytes:
        """The code, the mask of the two zones and the strength less one: 11 bytes."""
        if self.strength == 0:
            return Off().encode()
        return packed(WEAPON_CODE, *pack_ends(self.start, self.end), self.strength - 1)
