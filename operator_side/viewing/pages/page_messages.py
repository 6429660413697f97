"""Messages of a page of the console, of hands and of wishes to tune: frozen, and validated whole."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from common.limits import Share

Deflection = tuple[Annotated[float, Meta(ge=-1.0, le=1.0)], Annotated[float, Meta(ge=-1.0, le=1.0)]]
_LARGEST = 2**53 - 1
"""A browser counts exactly up to here."""


class PageHands(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The hands at one page; sent 50 times a second while they drive, and at once when anything changes."""

    page: Annotated[str, Meta(min_length=1, max_length=32)]
    """A word by which the page tells itself from others"""
    number: Annotated[int, Meta(ge=0, le=_LARGEST)]
    """Grows with each message of the page"""
    driving: bool = False
    """The person has asked to drive from this page"""
    run: bool = False
    """Hold-to-run is held"""
    l2: Share = 0.0
    """Calibrated travel of what retreats, 0 to 1"""
    r2: Share = 0.0
    """Calibrated travel of what advances, 0 to 1"""
    lateral: Deflection = (0.0, 0.0)
    """Across: right and up positive, -1 to 1 each, no dead zone"""
    turning: Deflection = (0.0, 0.0)
    gripper: Literal[-1, 0, 1] = 0
    """-1 opens, 1 closes, 0 holds"""
    next_target: bool = False
    hand_over: bool = False
    stop: bool = False
    """The emergency stop is pressed"""
    give_back: bool = False
    """The person lets the scripted one go on"""

    @property
    def moves_nothing(self) -> bool:
        """Triggers and sticks are at rest."""
        return self.l2 == self.r2 == 0.0 and self.lateral == self.turning == (0.0, 0.0)

    @property
    def all_up(self) -> bool:
        """Nothing is pressed at all."""
        pressed = self.run or self.gripper != 0 or self.next_target or self.hand_over or self.stop
        return self.moves_nothing and not pressed


class TuneWish(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The wish of a page for another P or link; None leaves it."""

    probability: Annotated[float, Meta(gt=0.0, lt=1.0)] | None = None
    link: Annotated[str, Meta(max_length=200)] | None = None
    """Netem's words"""


class PageMessage(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One message of a page."""

    hands: PageHands | None = None
    tune: TuneWish | None = None
