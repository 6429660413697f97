"""The battery's byte of an input report, and back. Layout: Linux hid-playstation."""

from typing import Final

from operator_side.controller.state import Battery, BatteryState

_STATES: Final = {
    0x0: BatteryState.DISCHARGING,
    0x1: BatteryState.CHARGING,
    0x2: BatteryState.FULL,
    0xA: BatteryState.OUT_OF_RANGE,
    0xB: BatteryState.TEMPERATURE,
    0xF: BatteryState.FAULT,
}
_CODES: Final = {state: code for code, state in _STATES.items()} | {BatteryState.UNKNOWN: 0x3}


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
    tenths = 0 if battery.fraction is None else min(int(battery.fraction * 10 + 1e-9), 10)
    return _CODES[battery.state] << 4 | tenths
