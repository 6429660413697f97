"""Layout of a gamepad: which axes are sticks and which are triggers, by what the kernel says of them.

Linux has several conventions. By its gamepad specification, and in older drivers, RX and RY are the right stick. In
HID's order Z and RZ are it.
"""

from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

X, Y, Z, RX, RY, RZ, GAS, BRAKE, HAT_X, HAT_Y = 0, 1, 2, 3, 4, 5, 9, 10, 16, 17
_HAT1X, _HAT1Y, _HAT2X, _HAT2Y = 18, 19, 20, 21
_SOUTH, _HID_THIRD, _TRIGGER_BUTTONS = 0x130, 0x132, {0x138, 0x139}
_CONTROLLERS: Final = range(0x120, 0x140)
"""Codes of keys that only joysticks, wheels and gamepads have"""
_NAMES: Final = {
    **dict(enumerate(("X", "Y", "Z", "RX", "RY", "RZ", "THROTTLE", "RUDDER", "WHEEL", "GAS", "BRAKE"))),
    **dict(enumerate(("HAT0X", "HAT0Y", "HAT1X", "HAT1Y", "HAT2X", "HAT2Y", "HAT3X", "HAT3Y"), HAT_X)),
    0x21: "PROFILE",
    0x28: "MISC",
}

Pair = tuple[int, int]
_LEFT: Final[Pair] = (X, Y)
_RIGHTS: Final[tuple[Pair, ...]] = ((RX, RY), (Z, RZ))
_TRIGGERS: Final[tuple[Pair, ...]] = ((_HAT2Y, _HAT2X), (BRAKE, GAS), (Z, RZ), (RX, RY), (_HAT1Y, _HAT1X))
"""L2 and R2 in each convention: the specification's, HID's pedals, the older drivers', HID's rotations; last the
specification's upper triggers, which are a gamepad's only ones"""


class Axis(NamedTuple):
    """Value, range and zone of rest of an axis, as the kernel gives them."""

    value: int
    least: int
    most: int
    flat: int = 0
    """Distance from the rest up to which the axis counts as resting"""

    def travel(self, value: int | None) -> float:
        """Return a trigger's travel at `value`, 0 to 1; at rest for None."""
        past = 0 if value is None else value - self.least
        return 0.0 if past <= self.flat else min(past / (self.most - self.least), 1.0)

    def deflection(self, value: int | None) -> float:
        """Return a stick's deflection at `value`, -1 to 1; at rest for None. A range with both signs rests at 0.

        Else it rests in the middle, or half a step beside it.
        """
        middle = 0.0 if self.least < 0 < self.most else (self.least + self.most) / 2
        past = 0.0 if value is None else value - middle
        if abs(past) <= self.flat + 0.5:
            return 0.0
        return max(-1.0, min(past / (self.most - middle if past > 0.0 else middle - self.least), 1.0))


class Layout(NamedTuple):
    """Codes of the axes: x and y of each stick, L2 and R2, and those of the directional pad."""

    left: Pair
    right: Pair
    triggers: Pair
    hats: tuple[int, ...] = ()

    def __str__(self) -> str:
        return f"sticks {names((*self.left, *self.right))}; triggers {names(self.triggers)}"


def is_controller(keys: set[int]) -> bool:
    """Return whether a device with these keys is a joystick, wheel or gamepad at all."""
    return any(key in keys for key in _CONTROLLERS)


def layout_of(keys: set[int], axes: Mapping[int, Axis], *, rumbles: bool) -> Layout | str:
    """Return the layout of a gamepad with these keys and axes; one that does not fit: in words, what is missing."""
    usable = {code for code, axis in axes.items() if axis.most > axis.least}
    pads = {code for code in usable if code >= HAT_X and axes[code].least < 0}
    rights = _RIGHTS[::-1] if _in_order_of_hid(keys, axes, usable) else _RIGHTS
    found = next(
        (
            Layout(_LEFT, right, triggers, tuple(hat for hat in (HAT_X, HAT_Y) if _is_hat(axes.get(hat))))
            for right in rights
            for triggers in _TRIGGERS
            if {*_LEFT, *right} <= usable and usable - pads >= {*triggers} and right != triggers
        ),
        None,
    )
    lacks = [] if _SOUTH in keys else ["buttons of a gamepad (BTN_SOUTH)"]
    if not usable.issuperset(_LEFT):
        lacks.append(f"left stick ({names(_LEFT)})")
    if not any(usable.issuperset(right) for right in _RIGHTS):
        lacks.append(f"right stick ({_either(_RIGHTS)})")
    if found is None and not lacks:
        buttons = ", only buttons" if keys >= _TRIGGER_BUTTONS else ""
        lacks.append(f"triggers with a travel{buttons} ({_either(_TRIGGERS)}, beside the sticks')")
    lacks += [] if rumbles else ["rumble"]
    if found is not None and not lacks:
        return found
    stuck = [f"{names([code])} from {axes[code].least} to {axes[code].most}" for code in sorted(axes.keys() - usable)]
    without_range = f"; without a range: {', '.join(stuck)}" if stuck else ""
    return f"no {', no '.join(lacks)}; its axes: {names(sorted(axes)) or 'none'}{without_range}"


def is_fresh(axes: Mapping[int, Axis]) -> bool:
    """Return whether no axis that may be a trigger or a stick has moved yet: the kernel says 0 wherever it rests."""
    return not any(axes[code].value for code in (Z, RX, RY, RZ) if code in axes)


def names(codes: Iterable[int]) -> str:
    """Return the kernel's names of axes, separated by commas."""
    return ", ".join(f"ABS_{_NAMES.get(code, f'{code:#x}')}" for code in codes)


def _either(pairs: Iterable[Pair]) -> str:
    return " or ".join(names(pair).replace(", ", " and ") for pair in pairs)


def _is_hat(axis: Axis | None) -> bool:
    """Return whether an axis is a directional pad's, not that of a touchpad as the Steam Deck has it there."""
    return axis is not None and (axis.least, axis.most) == (-1, 1)


def _in_order_of_hid(keys: set[int], axes: Mapping[int, Axis], usable: set[int]) -> bool:
    """Return whether Z and RZ rest in the middle and RX and RY at an end, so that the first are the right stick.

    Only where the buttons are numbered by HID, too: a hand may be at a trigger or stick now.
    """
    if _HID_THIRD not in keys or not usable.issuperset((Z, RX, RY, RZ)):
        return False
    share = {code: (axes[code].value - axes[code].least) / (axes[code].most - axes[code].least) for code in usable}
    return all(0.25 < share[code] < 0.75 for code in (Z, RZ)) and all(share[code] < 0.25 for code in (RX, RY))
