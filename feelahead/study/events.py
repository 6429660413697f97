"""Events of a study, one a line of its journal; everything else follows from them."""

from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from common.limits import Finite, check_limits

MOST_NUMBER: Final = 999
Number = Annotated[int, Meta(ge=1, le=MOST_NUMBER)]
EndedBy = Literal["placed", "limit", "experimenter"]


class _Event(msgspec.Struct, frozen=True, kw_only=True, tag_field="event", tag=str.lower, forbid_unknown_fields=True):
    participant: Number
    at_s: Finite
    """When it happened: seconds of the wall clock since 1970; of virtual time with simulated participants"""

    def __post_init__(self) -> None:
        check_limits(self)


class Enrolled(_Event, frozen=True):
    """The participant has a number."""

    simulated: bool = False
    """Whether this is a simulated person"""


class Consented(_Event, frozen=True):
    """The participant has signed."""


class _OfAttempt(_Event, frozen=True, kw_only=True):
    trial: Number
    """Number in the participant's plan, or of the practice try"""
    attempt: Number
    """1; more after a fault"""
    practice: bool = False

    @property
    def key(self) -> tuple[bool, int, int]:
        """Which attempt of the participant it is"""
        return self.practice, self.trial, self.attempt


class Begun(_OfAttempt, frozen=True):
    """A trial is about to begin."""


class Ended(_OfAttempt, frozen=True, kw_only=True):
    """A trial has come to its end, and its recording is whole."""

    success: bool | None = None
    """Whether the target was placed in time; None if it was not heard"""
    by: EndedBy | None = None
    """What ended it; None if it was not heard, and in older journals"""


class Failed(_OfAttempt, frozen=True, kw_only=True):
    """A trial has a fault: it counts for nothing, and is repeated."""

    reason: Annotated[str, Meta(min_length=1, max_length=200)]


class Answered(_Event, frozen=True, kw_only=True):
    """The questions after a block have their answers."""

    block: Number
    values: dict[str, float]
    """By the questions' names"""


class Rested(_Event, frozen=True, kw_only=True):
    """The rest after this many trials is over."""

    after: Number


class Paused(_Event, frozen=True):
    """Nothing more is begun."""


class Resumed(_Event, frozen=True):
    """The pause is over."""


class Withdrew(_Event, frozen=True, kw_only=True):
    """The participant takes part no longer."""

    reason: Annotated[str, Meta(max_length=200)] = ""


Event = Enrolled | Consented | Begun | Ended | Failed | Answered | Rested | Paused | Resumed | Withdrew


def event_of(content: Any) -> Event:
    """Return the event with these fields and its name in `event`; ValueError names a wrong one."""
    found: Event = msgspec.convert(content, Event)
    return found
