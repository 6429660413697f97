"""Programs that send pictures, each under a name: one sender for each name, in order, and answers to all."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Generic, Literal, TypeVar

import msgspec

from common.errors import OtherVersionError, RemoteProtocolError
from robot_side.drivers.remote.arm import Wire
from robot_side.drivers.remote.messages import Heard, Refusal, encode
from robot_side.drivers.remote.sender_clock import UNBOUNDED_S, SenderClock, Stamped

SILENT_S: Final = 1.0
"""Time without a picture of a name, in seconds, after which a note is made, and another sender may send it"""
MOST_NAMES: Final = 8
"""Largest number of names under which pictures are taken in a run"""
_REFUSAL_PERIOD_S: Final = 1.0

Why = Literal["second", "version", "malformed", "order", "clock", "undecodable", "mount", "late"]
Name = TypeVar("Name", bound=str)
_Message = TypeVar("_Message")


@dataclass
class _Sender:
    """Sender of the pictures of one name."""

    peer: bytes
    sequence: int = -1
    heard_s: float = -math.inf
    clock: SenderClock = field(default_factory=SenderClock)
    silent: bool = False


class Senders(Generic[Name]):
    """Who sends the pictures of each name, and what was refused."""

    def __init__(self, wire: Wire, kind: str, version: int, note: Callable[[str], None]) -> None:
        """kind: what is sent, in the plural, for notes. version: in answers. note: called with each fault's line."""
        self.rejected: Counter[Why] = Counter()
        """Number of rejected pictures by reason"""
        self.accepted = 0
        self._wire, self._kind, self._version, self._note = wire, kind, version, note
        self._senders: dict[Name, _Sender] = {}
        self._refused_s = -math.inf
        self._said: set[str] = set()

    def read(self, decode: Callable[[bytes], _Message], peer: bytes, payload: bytes, now_s: float) -> _Message | None:
        """Return what `decode` makes of the payload; None if it was refused."""
        try:
            return decode(payload)
        except OtherVersionError as error:
            self.reject("version", str(error), peer, now_s)
        except RemoteProtocolError as error:
            self.reject("malformed", str(error), peer, now_s)
        return None

    def admit(
        self, name: Name, message: Stamped, peer: bytes, received_s: float, now_s: float
    ) -> tuple[float, float] | None:
        """Return the earliest and latest time, on our clock, at which the picture `name` was taken, and answer it.

        None if it was refused: from a second sender, out of order, or with stamps that cannot be.
        """
        sender = self._senders.get(name)
        if sender is None and len(self._senders) >= MOST_NAMES:
            self.reject("second", f"{name} is one too many; valid: {MOST_NAMES} names at most", peer, now_s)
            return None
        if sender is not None and received_s - sender.heard_s <= SILENT_S:
            if peer != sender.peer:
                self.reject("second", f"another camera sends {name}, too; valid: one at a time", peer, now_s)
                return None
            if message.sequence <= sender.sequence:
                why = f"sequence = {message.sequence}; valid: above that of the picture before, {sender.sequence}"
                self.reject("order", why, peer, now_s)
                return None
        if sender is None or peer != sender.peer or message.sequence <= sender.sequence:
            sender = _Sender(peer, silent=sender is not None and sender.silent)
        if not sender.clock.update(message, received_s):
            sender.clock = SenderClock()
            why = "the sender's clock jumped, or echo_s and held_s are not from our answers"
            self.reject("clock", why, peer, now_s)
            return None
        if sender.clock.answers(message, now_s):
            self._wire.send(peer, msgspec.msgpack.encode(Heard(self._version, now_s)))
        if sender.clock.stays_unbounded(message):
            text = f"the age of {name} is not bounded, as no answer is echoed: it counts as {UNBOUNDED_S} s older"
            self._report_once(f"echo {name}", f"{self._kind}: {text} (docs/drivers.md)")
        self.accepted += 1
        self._senders[name] = sender
        sender.sequence, sender.heard_s = message.sequence, received_s
        return sender.clock.taken_s(message, received_s)

    def note_silences(self, now_s: float) -> None:
        """Tell which names have fallen silent, and which are heard again."""
        for name, sender in self._senders.items():
            silent = now_s - sender.heard_s > SILENT_S
            if silent is not sender.silent:
                sender.silent = silent
                text = f"none of {name} has come for {SILENT_S:g} s; the last one stays, with its age"
                self._note(f"{self._kind}: {text if silent else f'those of {name} arrive again'}")

    def refuse(self, why: Why, name: Name, text: str, now_s: float) -> None:
        """Refuse the picture `name` that was admitted last."""
        if name in self._senders:
            self.reject(why, f"{name}: {text}", self._senders[name].peer, now_s)

    def reject(self, why: Why, text: str, peer: bytes, now_s: float) -> None:
        """Count a refusal, tell the first of its kind, and answer the peer, once a second at most."""
        self.rejected[why] += 1
        told = f"one was refused: {text} (further {self._kind} with this fault are only counted)"
        self._report_once(why, f"{self._kind}: {told}")
        if now_s - self._refused_s >= _REFUSAL_PERIOD_S:
            self._refused_s = now_s
            self._wire.send(peer, encode(Refusal(self._version, text)))

    def summary(self) -> dict[str, int]:
        """Return the number of accepted pictures, and of rejected ones by reason."""
        return {"accepted": self.accepted} | {str(why): count for why, count in self.rejected.items()}

    def _report_once(self, about: str, text: str) -> None:
        if about not in self._said:
            self._said.add(about)
            self._note(text)
