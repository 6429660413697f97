"""The official trigger effects that shake: an amplitude of 0 (none) to 8 in each of the ten zones, and a frequency.

They hold nothing against the finger: their `zone_strengths` are 0. Source: Nielk1's notes, revision 6.
"""

from dataclasses import dataclass
from typing import ClassVar, Final, final

from common.checks import check_integer, check_integers
from operator_side.dualsense.effects.effect_codes import VIBRATION_CODE
from operator_side.dualsense.effects.resisting_effects import Off
from operator_side.dualsense.effects.zone_packing import (
    MAX_STRENGTH,
    NO_ZONES,
    ZONE_COUNT,
    pack_zones,
    stepped,
)

_LAST_ZONE: Final = ZONE_COUNT - 1
_MAX_FREQUENCY_HZ: Final = 255


def _encode_vibration(amplitudes: tuple[int, ...], frequency_hz: int) -> bytes:
    """Nothing that shakes is off."""
    if frequency_hz == 0 or not any(amplitudes):
        return Off().encode()
    return pack_zones(VIBRATION_CODE, amplitudes, frequency_hz)


@final
@dataclass(frozen=True, slots=True)
class Vibration:
    """A shaking of one amplitude from a zone to the end of the travel."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    position: int
    """The first zone that shakes, 0 to 9."""
    amplitude: int
    """0 to 8; 0 encodes as off."""
    frequency_hz: int
    """0 to 255; 0 encodes as off."""

    def __post_init__(self) -> None:
        check_integer("position", self.position, 0, _LAST_ZONE)
        check_integer("amplitude", self.amplitude, 0, MAX_STRENGTH)
        check_integer("frequency_hz", self.frequency_hz, 0, _MAX_FREQUENCY_HZ)

    @property
    def zone_amplitudes(self) -> tuple[int, ...]:
        """The amplitude in each of the ten zones, 0 to 8."""
        return stepped(self.position, self.amplitude)

    def encode(self) -> bytes:
        """The code, the zone mask, the packed amplitudes and the frequency: 11 bytes."""
        return _encode_vibration(self.zone_amplitudes, self.frequency_hz)


@final
@dataclass(frozen=True, slots=True)
class MultiPositionVibration:
    """A shaking with an amplitude for each zone."""

    zone_strengths: ClassVar[tuple[int, ...]] = NO_ZONES

    amplitudes: tuple[int, ...]
    """Ten amplitudes, 0 to 8; ten zeros encode as off."""
    frequency_hz: int
    """0 to 255; 0 encodes as off."""

    def __post_init__(self) -> None:
        check_integers("amplitudes", self.amplitudes, ZONE_COUNT, 0, MAX_STRENGTH)
        check_integer("frequency_hz", self.frequency_hz, 0, _MAX_FREQUENCY_HZ)

    @property
    def zone_amplitudes(self) -> tuple[int, ...]:
        """The amplitude in each of the ten zones, 0 to 8."""
        return self.amplitudes

    def encode(self) -> bytes:
        """The code, the zone mask, the packed amplitudes and the frequency: 11 bytes."""
        return _encode_vibration(self.amplitudes, self.frequency_hz)
