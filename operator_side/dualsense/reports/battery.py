"""The battery's byte, to a value and back. Source: Linux hid-playstation."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.limits import Share, check_limits

_FULLEST: Final = 10


class BatteryState(Enum):
    """Charging state; the faults are those that Linux hid-playstation names."""

    DISCHARGING = "discharging"
    CHARGING = "charging"
    FULL = "full"
    OUT_OF_RANGE = "not charging: voltage or temperature out of range"
    TEMPERATURE = "not charging: temperature"
    FAULT = "charging fault"
    UNKNOWN = "unknown"


_STATES: Final = {
    0x0: BatteryState.DISCHARGING,
    0x1: BatteryState.CHARGING,
    0x2: BatteryState.FULL,
    0xA: BatteryState.OUT_OF_RANGE,
    0xB: BatteryState.TEMPERATURE,
    0xF: BatteryState.FAULT,
}
_CODES: Final = {state: code for code, state in _STATES.items()} | {BatteryState.UNKNOWN: 0x3}


@dataclass(frozen=True, slots=True)
class Battery:
    """Charge and charging state."""

    fraction: Share | None = 1.0
    """0 to 1 in steps of a tenth, the middle of each; None when the controller reports a fault instead."""
    state: BatteryState = BatteryState.FULL

    def __post_init__(self) -> None:
        check_limits(self)


CHARGED: Final = Battery()


def _battery(byte: int) -> Battery:
    """A step of the fraction stands for ten per cent, and the middle of them is meant (hid-playstation)."""
    state = _STATES.get(byte >> 4, BatteryState.UNKNOWN)
    if state is BatteryState.FULL:
        return Battery(1.0, state)
    if state not in (BatteryState.DISCHARGING, BatteryState.CHARGING):
        return Battery(None, state)
    return Battery(min((2 * (byte & 0x0F) + 1) / 20, 1.0), state)


BATTERIES: Final = tuple(_battery(byte) for byte in range(256))
"""The battery by its byte."""


def battery_byte(battery: Battery) -> int:
    """The byte that says `battery`."""
    tenths = 0 if battery.fraction is None else min(int(battery.fraction * 10 + 1e-9), _FULLEST)
    return _CODES[battery.state] << 4 | tenths
