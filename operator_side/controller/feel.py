"""Effects of a controller as values: strengths of both triggers' zones, drive of the motors, colour of the light."""

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Annotated, Any, Final

from msgspec import Meta

from common.limits import Limited, Share, check_limits

ZONE_COUNT: Final = 10
MAX_STRENGTH: Final = 8
SENSED_TRAVEL: Final = 0.75
"""Mechanical travel, about, at which the reported travel reaches 1 (DS4Windows issue 1751).

The ten zones divide the mechanical travel, so a full pull does not enter the last ones."""

Strengths = tuple[int, ...]
"""Resistance of a trigger in each of its ten zones, 0 (none) to 8; the first zone begins at the released trigger."""
FREE_TRIGGER: Final[Strengths] = (0,) * ZONE_COUNT
"""Strengths of a trigger that only its spring resists."""

Byte = Annotated[int, Meta(ge=0, le=255)]
Color = tuple[Byte, Byte, Byte]
"""Red, green and blue."""
STANDS_DRIVE: Final = 0.7
HINDERED_DRIVE: Final = 0.4
"""Drives of the right motor: in the pulse by which a held object stands, and in the two by which the arm is hindered"""
WARNING_LIGHT: Final[Color] = (255, 0, 0)
USUAL_LIGHT: Final[Color] = (0, 0, 128)
"""Colour that Linux hid-playstation sets; restored after a warning"""


@dataclass(frozen=True, slots=True)
class Rumble(Limited):
    """Drive of the two motors, 0 to 1 each."""

    left: Share = 0.0
    right: Share = 0.0


def _check_strengths(name: str, strengths: object) -> None:
    try:
        # In every turn: `bytes` takes whole numbers only, and is quick.
        valid = isinstance(strengths, tuple) and len(strengths) == ZONE_COUNT and max(bytes(strengths)) <= MAX_STRENGTH
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise ValueError(
            f"{name} = {strengths!r}; valid: a tuple of {ZONE_COUNT} whole numbers from 0 to {MAX_STRENGTH}, or None"
        )


@dataclass(frozen=True, slots=True)
class Feel:
    """Effects to set together; None leaves a part of the controller unchanged."""

    l2: Strengths | None = None
    r2: Strengths | None = None
    rumble: Rumble | None = None
    light: Color | None = None

    def __post_init__(self) -> None:
        for name, strengths in (("l2", self.l2), ("r2", self.r2)):
            if strengths is not None:
                _check_strengths(name, strengths)
        if self.light is not None:
            check_limits(self)

    def completed_from(self, before: "Feel") -> "Feel":
        """Return these effects; where a part is None, take it from `before`, which was set earlier."""
        pairs = zip(_parts(self), _parts(before), strict=True)
        return Feel(*(old if new is None else new for new, old in pairs))

    def change_from(self, before: "Feel") -> "Feel":
        """Return only the parts that differ from those of `before`, with None for all other parts."""
        pairs = zip(_parts(self), _parts(before), strict=True)
        return Feel(*(None if new == old else new for new, old in pairs))

    @property
    def farewell(self) -> "Feel":
        """Effects that undo these: RELEASED, and the usual light if a light was set."""
        return RELEASED if self.light is None else Feel(FREE_TRIGGER, FREE_TRIGGER, Rumble(), USUAL_LIGHT)

    @property
    def releases(self) -> bool:
        """Whether these effects have neither resistance nor rumble."""
        return not any(self.l2 or ()) and not any(self.r2 or ()) and self.rumble in (None, Rumble())


_parts: Final[Callable[[Feel], tuple[Any, ...]]] = attrgetter("l2", "r2", "rumble", "light")
RELEASED: Final = Feel(FREE_TRIGGER, FREE_TRIGGER, Rumble())
"""Effects without resistance and rumble"""


def met(strengths: Strengths, reported: float) -> int:
    """Return the strength of the zone at `reported`, the raw travel as the controller reports it, 0 to 1."""
    return strengths[min(int(ZONE_COUNT * SENSED_TRAVEL * reported), ZONE_COUNT - 1)]
