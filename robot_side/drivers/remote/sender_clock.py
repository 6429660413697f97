"""Age of what a camera's or a perception's program sends, as far as stamps bound it (docs/drivers.md)."""

import math
from typing import Annotated, Final, TypeVar

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

from common.errors import RemoteProtocolError
from robot_side.drivers.remote.driver_clock import DriverClock
from robot_side.drivers.remote.messages import decoded

UNBOUNDED_S: Final = 0.5
"""Time by which a message may be older than it seems, where no echo bounds its age"""
_UNANSWERED: Final = 50
"""Number of answers without an echo after which the age of messages counts as unbounded"""


_Stamp = Annotated[float, Meta(ge=-1e12, le=1e12)]
"""Time in s; beyond these limits a double no longer resolves milliseconds."""


class Stamped(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Message whose times are on its sender's clock: what all but an arm's states begin with."""

    version: int
    sequence: Annotated[int, Meta(ge=0, le=2**53)]
    """Number that rises with every message of a sender"""
    sent_s: _Stamp
    taken_s: _Stamp
    """Time at which the camera took the picture, no later than `sent_s`"""
    echo_s: _Stamp | UnsetType | None = UNSET
    """`sent_s` of the newest answer that the sender has read, None before the first; UNSET: it wants no answers"""
    held_s: Annotated[float, Meta(ge=0.0, lt=1e6)] = 0.0
    """Time from reading that answer to `sent_s`, in s"""


_Message = TypeVar("_Message", bound=Stamped)


def decoded_stamped(payload: bytes, decoder: "msgspec.msgpack.Decoder[_Message]", version: int) -> _Message:
    """Unpack and validate a message; RemoteProtocolError names an invalid field."""
    message = decoded(payload, decoder, version)
    if message.taken_s > message.sent_s:
        raise RemoteProtocolError(f"taken_s = {message.taken_s}; valid: up to sent_s = {message.sent_s}")
    return message


class SenderClock:
    """Bounds of the sender's clock minus ours, from stamps of messages and of the answers that they echo."""

    def __init__(self) -> None:
        self._clock = DriverClock()
        self._first_answer_s, self._answers = math.inf, 0

    def update(self, message: Stamped, received_s: float) -> bool:
        """Take a message's stamps; False if they contradict earlier stamps."""
        echo_s, echoed = message.echo_s, None
        if isinstance(echo_s, float) and self._first_answer_s <= echo_s <= received_s:
            echoed = echo_s, message.held_s
        return self._clock.update(message.sent_s, received_s, echoed)

    def answers(self, message: Stamped, now_s: float) -> bool:
        """Return whether `message` is to be answered, and note that the answer leaves at `now_s`."""
        wanted = message.echo_s is not UNSET
        if wanted:
            self._answers += 1
            self._first_answer_s = min(self._first_answer_s, now_s)
        return wanted

    def stays_unbounded(self, message: Stamped) -> bool:
        """Return whether no echo bounds the age of messages, although there was time for one."""
        return not self._clock.known and (message.echo_s is UNSET or self._answers > _UNANSWERED)

    def taken_s(self, message: Stamped, received_s: float) -> tuple[float, float]:
        """Return the earliest and the latest possible time, on our clock, at which a message's picture was taken."""
        least_offset_s = self._clock.drivers_s(0.0)
        latest_s = min(message.taken_s - least_offset_s, received_s - (message.sent_s - message.taken_s))
        earliest_s = self._clock.ours_s(message.taken_s) if self._clock.known else latest_s - UNBOUNDED_S
        return min(earliest_s, latest_s), latest_s
