"""Pictures from a separate process that has the cameras, written in any language. Nothing is decoded here."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple, Protocol

import msgspec

from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.view_messages import ViewName
from robot_side.drivers.remote.arm import Wire
from robot_side.drivers.remote.driver_clock import DriverClock
from robot_side.drivers.remote.messages import Refusal, encode
from robot_side.drivers.remote.picture_message import (
    PICTURE_VERSION,
    Intrinsics,
    PictureHeard,
    PictureMessage,
    read_picture,
)

SILENT_S: Final = 1.0
"""Time without a picture of a view, in seconds, after which a note is made, and another sender may send it"""
UNBOUNDED_S: Final = 0.5
"""Time by which a picture may be older than it seems, where no echo bounds its age"""
_REFUSAL_PERIOD_S: Final = 1.0
_WATCHED_PERIOD_S, _UNWATCHED_PERIOD_S = 1.0 / 60.0, 0.25
"""Periods in which the port is asked for pictures"""
_BYTES_PER_S: Final = 16e6
"""Rate at which pictures are taken at most: those beyond are overtaken by newer ones at the port"""
_ASK_AGAIN_S: Final = 0.25
_UNANSWERED: Final = 50
"""Number of answers without an echo after which the age of pictures counts as unbounded"""

Why = Literal["second", "version", "malformed", "order", "clock", "undecodable"]


class AskedWire(Wire, Protocol):
    """Port whose newest messages arrive after each request."""

    def ask(self) -> bool:
        """Ask for the newest messages; return whether the request was sent."""
        ...


class TakenPicture(NamedTuple):
    """Picture of a view, as it was sent."""

    peer: bytes
    width: int
    height: int
    format: Literal["jpeg", "rgb8"]
    content: bytes
    captured_s: float
    """Earliest possible time at which it was taken, on our clock"""
    intrinsics: Intrinsics | None


@dataclass
class _Sender:
    """Sender of a view, and its newest picture."""

    peer: bytes
    sequence: int = -1
    heard_s: float = -math.inf
    clock: DriverClock = field(default_factory=DriverClock)
    answers: int = 0
    first_answer_s: float = math.inf
    newest: TakenPicture | None = None
    fresh: bool = False
    """Whether the newest picture has not been taken yet"""
    silent: bool = False


class RemotePictures:
    """Newest valid picture of each view that is sent, from one sender for each view."""

    def __init__(self, wire: AskedWire, note: Callable[[str], None]) -> None:
        """note: called with each fault's line."""
        self.rejected: Counter[Why] = Counter()
        """Number of rejected pictures by reason"""
        self.accepted = 0
        self._wire, self._note = wire, note
        self._senders: dict[ViewName, _Sender] = {}
        self._next_ask_s = self._refused_s = -math.inf
        self._said: set[str] = set()

    def update(self, now_s: float, *, watched: bool) -> None:
        """Take the pictures that have arrived, and ask for newer ones. watched: whether somebody looks at them."""
        arrived = self._wire.receive()
        for message in arrived:
            self._receive(*message, now_s)
        period_s = _WATCHED_PERIOD_S if watched else _UNWATCHED_PERIOD_S
        if arrived:
            size = sum(len(payload) for _, payload, _ in arrived)
            self._next_ask_s = now_s + max(period_s, size / _BYTES_PER_S)
        if now_s >= self._next_ask_s:
            # An answer may be lost with the process that owns the port.
            self._next_ask_s = now_s + _ASK_AGAIN_S
            self._wire.ask()
        for view, sender in self._senders.items():
            silent = now_s - sender.heard_s > SILENT_S
            if silent is not sender.silent:
                sender.silent = silent
                text = f"none of {view} has come for {SILENT_S:g} s; the last one stays, with its age"
                self._note(f"pictures: {text if silent else f'those of {view} arrive again'}")

    def sends(self, view: ViewName) -> bool:
        """Return whether a picture of this view has ever come."""
        return view in self._senders

    def fresh(self, view: ViewName) -> bool:
        """Return whether a picture of this view has come since the last `take`."""
        return view in self._senders and self._senders[view].fresh

    def take(self, view: ViewName) -> TakenPicture | None:
        """Return the newest picture of a view; None if it was taken before, or none has come."""
        if not self.fresh(view):
            return None
        self._senders[view].fresh = False
        return self._senders[view].newest

    def newest(self, view: ViewName) -> TakenPicture | None:
        """Return the newest picture of a view, taken or not; None if none has come."""
        return self._senders[view].newest if view in self._senders else None

    def refuse(self, view: ViewName, text: str, now_s: float) -> None:
        """Refuse the picture of a view that was taken last: it cannot be decoded."""
        if view in self._senders:
            self._reject("undecodable", f"{view}: {text}", self._senders[view].peer, now_s)

    def summary(self) -> dict[str, int]:
        """Return the number of accepted pictures, and of rejected ones by reason."""
        return {"accepted": self.accepted} | {str(why): count for why, count in self.rejected.items()}

    def _receive(self, peer: bytes, payload: bytes, received_s: float, now_s: float) -> None:
        try:
            self._take_in(read_picture(payload), peer, received_s, now_s)
        except OtherVersionError as error:
            self._reject("version", str(error), peer, now_s)
        except RemoteProtocolError as error:
            self._reject("malformed", str(error), peer, now_s)

    def _take_in(self, message: PictureMessage, peer: bytes, received_s: float, now_s: float) -> None:
        view = message.view
        sender = self._senders.get(view)
        if sender is not None and received_s - sender.heard_s <= SILENT_S:
            if peer != sender.peer:
                why = f"another camera sends {view}, too; valid: one at a time"
                self._reject("second", why, peer, now_s)
                return
            if message.sequence <= sender.sequence:
                why = f"sequence = {message.sequence}; valid: above that of the picture before, {sender.sequence}"
                self._reject("order", why, peer, now_s)
                return
        begins = sender is None or peer != sender.peer or message.sequence <= sender.sequence
        if sender is None or begins:
            sender = _Sender(peer, silent=sender is not None and sender.silent)
        if not self._reads_clock(sender, message, received_s):
            sender.clock = DriverClock()
            why = "the sender's clock jumped, or echo_s and held_s are not from our answers"
            self._reject("clock", why, peer, now_s)
            return
        self._answer(sender, message, now_s)
        self.accepted += 1
        self._senders[view] = sender
        sender.sequence, sender.heard_s, sender.fresh = message.sequence, received_s, True
        sender.newest = TakenPicture(
            *(peer, message.width, message.height, message.format, message.content),
            captured_s=_taken_s(sender.clock, message, received_s),
            intrinsics=message.intrinsics,
        )

    def _reads_clock(self, sender: _Sender, message: PictureMessage, received_s: float) -> bool:
        echo_s, echoed = message.echo_s, None
        if isinstance(echo_s, float) and sender.first_answer_s <= echo_s <= received_s:
            echoed = echo_s, message.held_s
        return sender.clock.update(message.sent_s, received_s, echoed)

    def _answer(self, sender: _Sender, message: PictureMessage, now_s: float) -> None:
        """Send what the sender echoes, if it does."""
        if message.echo_s is not msgspec.UNSET:
            sender.answers += 1
            sender.first_answer_s = min(sender.first_answer_s, now_s)
            self._wire.send(sender.peer, msgspec.msgpack.encode(PictureHeard(PICTURE_VERSION, now_s)))
        if not sender.clock.known and (message.echo_s is msgspec.UNSET or sender.answers > _UNANSWERED):
            text = (
                f"the age of {message.view} is not bounded, as no answer is echoed: it counts as {UNBOUNDED_S} s older"
            )
            self._report_once(f"echo {message.view}", f"pictures: {text} (docs/drivers.md)")

    def _report_once(self, about: str, text: str) -> None:
        if about not in self._said:
            self._said.add(about)
            self._note(text)

    def _reject(self, why: Why, text: str, peer: bytes, now_s: float) -> None:
        self.rejected[why] += 1
        self._report_once(why, f"pictures: one was refused: {text} (further pictures with this fault are only counted)")
        if now_s - self._refused_s >= _REFUSAL_PERIOD_S:
            self._refused_s = now_s
            self._wire.send(peer, encode(Refusal(PICTURE_VERSION, text)))


def _taken_s(clock: DriverClock, message: PictureMessage, received_s: float) -> float:
    """Return the earliest possible time on our clock at which the picture was taken."""
    latest_s = received_s - (message.sent_s - message.taken_s)
    return min(latest_s, clock.ours_s(message.taken_s) if clock.known else latest_s - UNBOUNDED_S)
