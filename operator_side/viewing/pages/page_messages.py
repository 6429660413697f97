"""Messages of a console page, hands and tuning wishes: frozen, and validated whole."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from common.limits import Finite, Share

Deflection = tuple[Annotated[float, Meta(ge=-1.0, le=1.0)], Annotated[float, Meta(ge=-1.0, le=1.0)]]
_LARGEST = 2**53 - 1
"""Largest integer that a browser represents exactly."""


class PageHands(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hands at one page; sent 50 times a second while they drive, and at once on any change."""

    page: Annotated[str, Meta(min_length=1, max_length=32)]
    """Word that identifies the page"""
    number: Annotated[int, Meta(ge=0, le=_LARGEST)]
    """Sequence number of the page's messages"""
    driving: bool = False
    """Whether the person has asked to drive from this page"""
    run: bool = False
    """Whether hold-to-run is held"""
    l2: Share = 0.0
    """Calibrated travel of the trigger that retreats, 0 to 1"""
    r2: Share = 0.0
    """Calibrated travel of the trigger that advances, 0 to 1"""
    lateral: Deflection = (0.0, 0.0)
    """Deflection across: right and up positive, -1 to 1 each, no dead zone"""
    turning: Deflection = (0.0, 0.0)
    gripper: Literal[-1, 0, 1] = 0
    """-1 opens, 1 closes, 0 holds"""
    next_target: bool = False
    hand_over: bool = False
    stop: bool = False
    """Whether the emergency stop is pressed"""
    reset: bool = False
    """Whether the person resets the stop"""
    give_back: bool = False
    """Whether the person hands back to the scripted one"""
    shown_s: Finite | None = None
    """Capture time of the picture shown in the first view, on the robot side's clock; None without one"""

    @property
    def moves_nothing(self) -> bool:
        """Whether triggers and sticks are at rest."""
        return self.l2 == self.r2 == 0.0 and self.lateral == self.turning == (0.0, 0.0)

    @property
    def all_up(self) -> bool:
        """Whether nothing is pressed."""
        pressed = self.run or self.gripper != 0 or self.next_target or self.hand_over or self.stop or self.reset
        return self.moves_nothing and not pressed


class TuneWish(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Wish of a page for another P or link; None leaves it."""

    probability: Annotated[float, Meta(gt=0.0, lt=1.0)] | None = None
    link: Annotated[str, Meta(max_length=200)] | None = None
    """Link in netem's words"""


class PageMessage(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Message of a page."""

    hands: PageHands | None = None
    tune: TuneWish | None = None
