"""The bytes of touch points, battery and sockets, to values and back. Sources: Linux hid-playstation, the wiki."""

from typing import Final

from operator_side.dualsense.reports.attachments import Battery, BatteryState, Connections, TouchPoint

NOT_TOUCHED: Final = 0x80
"""In the first byte of a touch point: no finger."""

_BATTERY_STATES: Final = {
    0x0: BatteryState.DISCHARGING,
    0x1: BatteryState.CHARGING,
    0x2: BatteryState.FULL,
    0xA: BatteryState.OUT_OF_RANGE,
    0xB: BatteryState.TEMPERATURE,
    0xF: BatteryState.FAULT,
}
_BATTERY_CODES: Final = {state: code for code, state in _BATTERY_STATES.items()} | {BatteryState.UNKNOWN: 0x3}
_FULLEST: Final = 10


def _battery(byte: int) -> Battery:
    """A step of the fraction stands for ten per cent, and the middle of them is meant (hid-playstation)."""
    state = _BATTERY_STATES.get(byte >> 4, BatteryState.UNKNOWN)
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
    return _BATTERY_CODES[battery.state] << 4 | tenths


CONNECTIONS: Final = tuple(
    Connections(*(bool(byte >> bit & 1) for bit in range(5)))  # in the order of the fields
    for byte in range(256)
)
"""What is plugged in by its byte."""


def connections_byte(connections: Connections) -> int:
    """The byte that says `connections`."""
    bits = (
        connections.headphones,
        connections.microphone,
        connections.muted,
        connections.usb_data,
        connections.usb_power,
    )
    return sum(plugged << bit for bit, plugged in enumerate(bits))


def touch_point(code: int) -> TouchPoint:
    """A finger by its four bytes as one number, little-endian, in which NOT_TOUCHED is not set."""
    return TouchPoint(code & 0x7F, code >> 8 & 0xFFF, code >> 20)


def touch_code(point: TouchPoint | None) -> int:
    """The four bytes of a touch point as one number."""
    return NOT_TOUCHED if point is None else point.identity | point.x << 8 | point.y << 20
