"""Messages of a console page: inputs and tuning requests. One invalid field refuses the whole message."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from common.episode import EpisodeMark
from common.limits import Finite, Share

Deflection = tuple[Annotated[float, Meta(ge=-1.0, le=1.0)], Annotated[float, Meta(ge=-1.0, le=1.0)]]
_LARGEST = 2**53 - 1
"""Largest integer that a browser represents exactly."""


class PageHands(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Inputs at one page; sent at once on any change, and 50 times a second while the page drives or stops the arm.

    While the page's drawing is late, its worker repeats the last inputs with their age.
    """

    page: Annotated[str, Meta(min_length=1, max_length=32)]
    """Word that identifies the page"""
    number: Annotated[int, Meta(ge=0, le=_LARGEST)]
    """Sequence number of the page's messages"""
    age_s: Annotated[float, Meta(ge=0.0, le=1e9)] = 0.0
    """Time since the page's drawing thread confirmed these inputs"""
    driving: bool = False
    """Whether the operator has asked to drive from this page"""
    run: bool = False
    """Whether hold-to-run is held"""
    l2: Share = 0.0
    """Calibrated travel of the trigger that moves the gripper back, 0 to 1"""
    r2: Share = 0.0
    """Calibrated travel of the trigger that moves the gripper forward, 0 to 1"""
    keyed: bool = False
    """Whether keys pull the triggers, so that zones must stop the pull; a gamepad's trigger is pulled by a finger"""
    lateral: Deflection = (0.0, 0.0)
    """Deflection of the stick that moves across: right and up positive, -1 to 1 each, dead zone removed"""
    turning: Deflection = (0.0, 0.0)
    """Deflection of the stick that turns, likewise"""
    gripper: Literal[-1, 0, 1] = 0
    """-1 opens the gripper, 1 closes it, 0 leaves it"""
    next_target: bool = False
    next_speed: bool = False
    next_frame: bool = False
    home: bool = False
    hand_over: bool = False
    stop: bool = False
    """Whether the emergency stop is pressed"""
    reset: bool = False
    """Whether the person resets the stop"""
    give_back: bool = False
    """Whether the operator hands the controls back to the scripted person"""
    shown_s: Finite | None = None
    """Capture time of the picture shown in the first view, on the robot side's clock; None without one"""

    @property
    def moves_nothing(self) -> bool:
        """Whether triggers and sticks are at rest."""
        return self.l2 == self.r2 == 0.0 and self.lateral == self.turning == (0.0, 0.0)

    @property
    def all_up(self) -> bool:
        """Whether no trigger, stick, key or button is used."""
        pressed = self.run or self.gripper != 0 or self.stop or self.reset
        chosen = self.next_target or self.next_speed or self.next_frame or self.home or self.hand_over
        return self.moves_nothing and not (pressed or chosen)


class TuneWish(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Request of a page for another probability P or another emulated link; None leaves a value unchanged."""

    probability: Annotated[float, Meta(gt=0.0, lt=1.0)] | None = None
    link: Annotated[str, Meta(max_length=200)] | None = None
    """Emulated link, in netem's words"""


class PageMessage(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Message of a page: inputs, a tuning request, a mark of an episode, or several of them."""

    hands: PageHands | None = None
    tune: TuneWish | None = None
    mark: EpisodeMark | None = None
