"""The bits of sticks and buttons: three bytes to the set of what is pressed, a byte to an axis, and back."""

from functools import lru_cache
from typing import Final

from operator_side.dualsense.reports.controller_state import Button

_HAT_DIRECTIONS: Final = (
    frozenset({Button.UP}),
    frozenset({Button.UP, Button.RIGHT}),
    frozenset({Button.RIGHT}),
    frozenset({Button.DOWN, Button.RIGHT}),
    frozenset({Button.DOWN}),
    frozenset({Button.DOWN, Button.LEFT}),
    frozenset({Button.LEFT}),
    frozenset({Button.UP, Button.LEFT}),
)
"""Clockwise from up; any other number is HID's null state: no direction."""
_HAT_NONE: Final = 8
_DIRECTIONS: Final = frozenset({Button.UP, Button.RIGHT, Button.DOWN, Button.LEFT})

_BUTTON_BITS: Final = {
    Button.SQUARE: 4,
    Button.CROSS: 5,
    Button.CIRCLE: 6,
    Button.TRIANGLE: 7,
    Button.L1: 8,
    Button.R1: 9,
    Button.L2: 10,
    Button.R2: 11,
    Button.CREATE: 12,
    Button.OPTIONS: 13,
    Button.L3: 14,
    Button.R3: 15,
    Button.PS: 16,
    Button.TOUCHPAD: 17,
    Button.MUTE: 18,
    Button.LEFT_FUNCTION: 20,
    Button.RIGHT_FUNCTION: 21,
    Button.LEFT_PADDLE: 22,
    Button.RIGHT_PADDLE: 23,
}
"""Bit numbers in the three bytes as one little-endian number; the low nibble is the directional pad's hat."""


def _axis(byte: int) -> float:
    """-1 at 0, 0 at 128, 1 at 255: the halves differ by one step."""
    return (byte - 128) / (127 if byte > 128 else 128)


AXIS: Final = tuple(_axis(byte) for byte in range(256))
"""A stick's byte to -1 to 1."""
AXIS_DOWN: Final = tuple(0.0 - _axis(byte) for byte in range(256))
"""A stick's byte of a vertical axis to -1 to 1: down is positive on the wire."""
TRAVEL: Final = tuple(byte / 255 for byte in range(256))
"""A trigger's byte to 0 to 1."""


def byte_of_axis(axis: float) -> int:
    """The nearest byte of -1 to 1."""
    return 128 + round(axis * (127 if axis > 0.0 else 128))


@lru_cache(maxsize=4096)
def pressed_of(code: int) -> frozenset[Button]:
    """Decode the three bytes as one number; results are cached, as hands hold few combinations."""
    pressed = {button for button, bit in _BUTTON_BITS.items() if code >> bit & 1}
    hat = code & 0x0F
    return frozenset(pressed | _HAT_DIRECTIONS[hat] if hat < len(_HAT_DIRECTIONS) else pressed)


def code_of(pressed: frozenset[Button]) -> int:
    """The three bytes as one number. `pressed`: no two opposite directions."""
    directions = pressed & _DIRECTIONS
    code = _HAT_DIRECTIONS.index(directions) if directions else _HAT_NONE
    for button in pressed - _DIRECTIONS:
        code |= 1 << _BUTTON_BITS[button]
    return code
