"""What a controller is told to let the hands feel, as values: strengths along both triggers, motors, a light."""

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Annotated, Any, Final

from msgspec import Meta

from common.limits import Limited, Share, check_limits

ZONE_COUNT: Final = 10
MAX_STRENGTH: Final = 8
SENSED_TRAVEL: Final = 0.75
"""The mechanical travel at which a controller reports 1 (about; DS4Windows issue 1751). Zones divide the mechanical."""

Strengths = tuple[int, ...]
"""A trigger's resistance in each of ten zones, 0 (none) to 8, the first for the zone where the finger starts."""
FREE_TRIGGER: Final[Strengths] = (0,) * ZONE_COUNT
"""The trigger's own spring and nothing else."""

Byte = Annotated[int, Meta(ge=0, le=255)]
Color = tuple[Byte, Byte, Byte]
"""Red, green and blue."""
WARNING_LIGHT: Final[Color] = (255, 0, 0)
USUAL_LIGHT: Final[Color] = (0, 0, 128)
"""The color that Linux hid-playstation sets; we set it again after a warning."""


@dataclass(frozen=True, slots=True)
class Rumble(Limited):
    """The two motors' drive, 0 to 1 each."""

    left: Share = 0.0
    right: Share = 0.0


def _check_strengths(name: str, strengths: object) -> None:
    try:
        # At 1 kHz: `bytes` takes whole numbers only, and is quick.
        valid = isinstance(strengths, tuple) and len(strengths) == ZONE_COUNT and max(bytes(strengths)) <= MAX_STRENGTH
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise ValueError(
            f"{name} = {strengths!r}; valid: a tuple of {ZONE_COUNT} whole numbers from 0 to {MAX_STRENGTH}, or None"
        )


@dataclass(frozen=True, slots=True)
class Feel:
    """The parts of a controller that are set at once; None leaves a part as it is."""

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

    def following(self, before: "Feel") -> "Feel":
        """Join both, this one after `before`: each part by the newest that sets it."""
        pairs = zip(_parts(self), _parts(before), strict=True)
        return Feel(*(old if new is None else new for new, old in pairs))

    def change_from(self, before: "Feel") -> "Feel":
        """The parts of this one that differ from those of `before`; the others are None."""
        pairs = zip(_parts(self), _parts(before), strict=True)
        return Feel(*(None if new == old else new for new, old in pairs))

    @property
    def farewell(self) -> "Feel":
        """What undoes this one: RELEASED, and the usual light if this one sets a light."""
        return RELEASED if self.light is None else Feel(FREE_TRIGGER, FREE_TRIGGER, Rumble(), USUAL_LIGHT)

    @property
    def releases(self) -> bool:
        """Whether nothing that it sets holds or shakes."""
        return not any(self.l2 or ()) and not any(self.r2 or ()) and self.rumble in (None, Rumble())


_parts: Final[Callable[[Feel], tuple[Any, ...]]] = attrgetter("l2", "r2", "rumble", "light")
RELEASED: Final = Feel(FREE_TRIGGER, FREE_TRIGGER, Rumble())
"""No resistance of either trigger, no rumble."""


def met(strengths: Strengths, reported: float) -> int:
    """The strength that a finger meets at a travel as the controller reports it, 0 to 1."""
    return strengths[min(int(ZONE_COUNT * SENSED_TRAVEL * reported), ZONE_COUNT - 1)]
