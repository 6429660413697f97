"""Trigger effects that controllers know and no official library offers: sent and read only when asked for.

Nielk1's notes, revision 6, found them; they advise against the simple ones, whose units are raw. What a finger
feels of them was never measured: only the bow's resistance is taken for one (`zone_strengths`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final, final

from common.checks import check_integer
from operator_side.dualsense.effects.effect_codes import (
    BOW_CODE,
    GALLOPING_CODE,
    MACHINE_CODE,
    SIMPLE_FEEDBACK_CODE,
    SIMPLE_VIBRATION_CODE,
    SIMPLE_WEAPON_CODE,
)
from operator_side.dualsense.effects.zone_packing import (
    MAX_STRENGTH,
    NO_ZONES,
    between,
    pack_ends,
    packed,
    unpack_ends,
)


def _check_ends(start: int, end: int, highest: int) -> None:
    check_integer("start", start, 0, 8)
    check_integer("end", end, start + 1, highest)


def _check_bytes(**values: int) -> None:
    for name, value in values.items():
        check_integer(name, value, 0, 255)


@final
@dataclass(frozen=True, slots=True)
class Bow:
    """A resistance like `Weapon`'s that snaps back."""

    start: int
    """0 to 7."""
    end: int
    """start + 1 to 8."""
    strength: int
    """1 to 8."""
    snap: int
    """The force of the snap, 1 to 8."""

    def __post_init__(self) -> None:
        _check_ends(self.start, self.end, 8)
        check_integer("strength", self.strength, 1, MAX_STRENGTH)
        check_integer("snap", self.snap, 1, MAX_STRENGTH)

    @property
    def zone_strengths(self) -> tuple[int, ...]:
        """The resistance of each of the ten zones before the snap."""
        return between(self.start, self.end, self.strength)

    def encode(self) -> bytes:
        """The code, the mask of the two zones and both forces less one: 11 bytes."""
        return packed(BOW_CODE, *pack_ends(self.start, self.end), (self.snap - 1) << 3 | self.strength - 1)


@final
@dataclass(frozen=True, slots=True)
class Galloping:
    """Two beats in turn, like hooves."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    start: int
    """0 to 8."""
    end: int
    """start + 1 to 9."""
    first_foot: int
    """When in the cycle the first beat comes, 0 to 6."""
    second_foot: int
    """first_foot + 1 to 7."""
    frequency_hz: int
    """1 to 255."""

    def __post_init__(self) -> None:
        _check_ends(self.start, self.end, 9)
        check_integer("first_foot", self.first_foot, 0, 6)
        check_integer("second_foot", self.second_foot, self.first_foot + 1, 7)
        check_integer("frequency_hz", self.frequency_hz, 1, 255)

    def encode(self) -> bytes:
        """The code, the mask of the two zones, both beats and the frequency: 11 bytes."""
        feet = self.first_foot << 3 | self.second_foot
        return packed(GALLOPING_CODE, *pack_ends(self.start, self.end), feet, self.frequency_hz)


@final
@dataclass(frozen=True, slots=True)
class Machine:
    """A shaking that changes between two amplitudes."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    start: int
    """0 to 8."""
    end: int
    """start + 1 to 9."""
    amplitude_a: int
    """0 to 7."""
    amplitude_b: int
    """0 to 7."""
    frequency_hz: int
    """1 to 255."""
    period_ds: int
    """How long each amplitude lasts, in tenths of a second, 0 to 255."""

    def __post_init__(self) -> None:
        _check_ends(self.start, self.end, 9)
        check_integer("amplitude_a", self.amplitude_a, 0, 7)
        check_integer("amplitude_b", self.amplitude_b, 0, 7)
        check_integer("frequency_hz", self.frequency_hz, 1, 255)
        check_integer("period_ds", self.period_ds, 0, 255)

    def encode(self) -> bytes:
        """The code, the mask of the two zones, both amplitudes, the frequency and the period: 11 bytes."""
        both = self.amplitude_b << 3 | self.amplitude_a
        return packed(MACHINE_CODE, *pack_ends(self.start, self.end), both, self.frequency_hz, self.period_ds)


@final
@dataclass(frozen=True, slots=True)
class SimpleFeedback:
    """One resistance from a position on; raw bytes."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    position: int
    strength: int

    def __post_init__(self) -> None:
        _check_bytes(position=self.position, strength=self.strength)

    def encode(self) -> bytes:
        """The code, the position and the strength: 11 bytes."""
        return packed(SIMPLE_FEEDBACK_CODE, self.position, self.strength)


@final
@dataclass(frozen=True, slots=True)
class SimpleWeapon:
    """A resistance between two positions; raw bytes."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    start: int
    end: int
    strength: int

    def __post_init__(self) -> None:
        _check_bytes(start=self.start, end=self.end, strength=self.strength)

    def encode(self) -> bytes:
        """The code, both positions and the strength: 11 bytes."""
        return packed(SIMPLE_WEAPON_CODE, self.start, self.end, self.strength)


@final
@dataclass(frozen=True, slots=True)
class SimpleVibration:
    """A shaking from a position on; raw bytes."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    frequency_hz: int
    amplitude: int
    position: int

    def __post_init__(self) -> None:
        _check_bytes(frequency_hz=self.frequency_hz, amplitude=self.amplitude, position=self.position)

    def encode(self) -> bytes:
        """The code, the frequency, the amplitude and the position: 11 bytes."""
        return packed(SIMPLE_VIBRATION_CODE, self.frequency_hz, self.amplitude, self.position)


UnofficialEffect = Bow | Galloping | Machine | SimpleFeedback | SimpleWeapon | SimpleVibration


def _decode_bow(encoded: bytes) -> Bow:
    return Bow(*unpack_ends(encoded), strength=(encoded[3] & 7) + 1, snap=(encoded[3] >> 3) + 1)


def _decode_galloping(encoded: bytes) -> Galloping:
    return Galloping(*unpack_ends(encoded), encoded[3] >> 3, encoded[3] & 7, encoded[4])


def _decode_machine(encoded: bytes) -> Machine:
    return Machine(*unpack_ends(encoded), encoded[3] & 7, encoded[3] >> 3, encoded[4], encoded[5])


UNOFFICIAL_DECODERS: Final[dict[int, Callable[[bytes], UnofficialEffect]]] = {
    BOW_CODE: _decode_bow,
    GALLOPING_CODE: _decode_galloping,
    MACHINE_CODE: _decode_machine,
    SIMPLE_FEEDBACK_CODE: lambda encoded: SimpleFeedback(*encoded[1:3]),
    SIMPLE_WEAPON_CODE: lambda encoded: SimpleWeapon(*encoded[1:4]),
    SIMPLE_VIBRATION_CODE: lambda encoded: SimpleVibration(*encoded[1:4]),
}
"""What reads each code; ValueError for a field out of its range. decode_effect checks the rest."""
