"""Play a recording: the facts and views that the operator saw, in order, at any speed and from any time."""

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any, Final, NamedTuple

import msgspec

from common.errors import ConfigurationError, OtherVersionError, RemoteProtocolError
from common.protocol.codec import decode, decode_view, encode
from common.protocol.view_messages import SceneState, VideoFrame
from common.recording.entries import Kind, split_text, unpack_block
from common.recording.images import read_image
from common.recording.reading import Message, Recording
from common.status.statuses import RobotStatus
from operator_side.viewing.facts import OperatorFacts

FACTS: Final = b"f"
VIEW: Final = b"v"
ROBOT: Final = b"s"
_NANOSECONDS: Final = 1e-9
_FACTS: Final = "/operator/facts"
_ROBOT: Final = "/robot/status"
_TOPICS: Final = (_ROBOT, _FACTS, "/view", "/camera/overview", "/camera/first_person")


class Seen(NamedTuple):
    """One recorded item that the console can show."""

    time_s: float
    """Time since the recording began"""
    kind: bytes
    """FACTS: OperatorFacts as JSON. VIEW: a view payload. ROBOT: the robot side's status as JSON."""
    name: str
    """Name of what the item shows; an item replaces earlier items of the same name"""
    content: bytes


def require_protocol(recording: Recording) -> None:
    """Raise ConfigurationError if the first recorded message that a side sent has another protocol version."""
    for message in recording.messages([f"/{side}/inputs" for side in recording.headers]):
        for entry in unpack_block(message.content).unpacked():
            if entry.kind == Kind.SENT:
                try:
                    decode(split_text(split_text(entry.content)[1])[1])
                except OtherVersionError as error:
                    raise ConfigurationError(f"{recording.path}: recorded with {error}") from error
                return


def require_statuses(recording: Recording) -> None:
    """Raise ConfigurationError if nothing can be shown, or a side's first status is of a release with other fields."""
    recording.require(_TOPICS)
    for topic, struct in ((_FACTS, OperatorFacts), (_ROBOT, RobotStatus)):
        for message in recording.messages((topic,)):
            try:
                msgspec.json.decode(message.content, type=struct)
            except msgspec.ValidationError as error:
                why = f"{topic} is of another release ({error}); what works: feelahead export, or replay --check"
                raise ConfigurationError(f"{recording.path}: {why}") from error
            break


def seen(recording: Recording) -> Iterator[Seen]:
    """Yield all items that the console can show, in order; pictures are put back into the payloads of their views."""
    began_ns = recording.began_ns
    pictures: dict[tuple[str, int], list[bytes]] = {}
    for message in recording.messages(_TOPICS):
        time_s = _NANOSECONDS * (message.log_ns - began_ns)
        if message.topic in (_FACTS, _ROBOT):
            yield Seen(time_s, FACTS if message.topic == _FACTS else ROBOT, message.topic, message.content)
        elif message.topic == "/view":
            yield Seen(time_s, VIEW, *_view(message, pictures))
        else:
            image = read_image(message.content)
            pictures = {key: waiting for key, waiting in pictures.items() if key[1] == message.log_ns}
            pictures.setdefault((image.view, message.log_ns), []).append(image.jpeg)


def _view(message: Message, pictures: dict[tuple[str, int], list[bytes]]) -> tuple[str, bytes]:
    """Return the name of what the view payload shows, and the payload as it was sent.

    pictures: those that precede the payloads of the same view and time; its own is taken from them.
    """
    try:
        view = decode_view(message.content)
    except RemoteProtocolError:
        return "telemetry", message.content  # also for a payload of another version
    if not isinstance(view, VideoFrame):
        return "state" if isinstance(view, SceneState) else "shapes", message.content
    waiting = pictures.get((view.view, message.log_ns))
    return view.view, encode(msgspec.structs.replace(view, jpeg=waiting.pop(0) if waiting else b""))


SLOWEST: Final = 0.01
FASTEST: Final = 1000.0


class Wish(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Change of the playback that a person wishes at the page; None: no change."""

    paused: bool | None = None
    speed: float | None = None
    at_s: float | None = None


class Playback:
    """Playback of one recording; it begins at the start of the recording, paused."""

    def __init__(self, recording: Recording, speed: float = 1.0) -> None:
        self.at_s = 0.0
        """Position, in seconds since the recording began"""
        self.length_s = recording.length_s()
        self.speed = speed
        """Speed of playing; 1 is the speed of the recorded run"""
        self.paused = True
        self._recording = recording
        self._coming = seen(recording)
        self._jumped: list[Seen] = []
        self._newest: dict[str, Seen] = {}
        """Items that are shown at present, by name"""

    @property
    def over(self) -> bool:
        """Whether the end of the recording is reached."""
        return self.at_s >= self.length_s

    def wish(self, content: Any) -> None:
        """Apply the wish that a page sent; ignore an invalid wish, and values out of range."""
        try:
            wish = msgspec.convert(content, Wish)
        except msgspec.ValidationError:
            return
        if wish.speed is not None and SLOWEST <= wish.speed <= FASTEST:
            self.speed = wish.speed
        if wish.at_s is not None and 0.0 <= wish.at_s <= self.length_s:
            self._jump(wish.at_s)
        if wish.paused is not None:
            if self.over and not wish.paused:
                self._jump(0.0)
            self.paused = wish.paused

    def advance(self, passed_s: float) -> list[Seen]:
        """Advance by `passed_s` seconds of real time; return the items that are now due.

        After a jump, the due items are the newest of each name before the new position.
        """
        due, self._jumped = self._jumped, []
        if not self.paused:
            self.at_s = min(self.at_s + self.speed * passed_s, self.length_s)
            due += self._until(self.at_s)
            self.paused = self.over
        self._newest.update((one.name, one) for one in due)
        return due

    def show_again(self) -> None:
        """Have the next `advance` return the items that are shown at present once more, for a new viewer."""
        self._jumped = _newest((*self._newest.values(), *self._jumped))

    def state(self) -> dict[str, Any]:
        """Return position, length, speed and pause, as the page shows them."""
        return {"at_s": self.at_s, "length_s": self.length_s, "speed": self.speed, "paused": self.paused}

    def _jump(self, to_s: float) -> None:
        if to_s < self.at_s:
            self._coming = seen(self._recording)
            self._newest.clear()
        self.at_s = to_s
        self._jumped = _newest((*self._jumped, *self._until(to_s)))

    def _until(self, end_s: float) -> Iterator[Seen]:
        for one in self._coming:
            if one.time_s > end_s:
                self._coming = chain((one,), self._coming)
                return
            yield one


def _newest(many: Iterable[Seen]) -> list[Seen]:
    """Keep the newest item of each name; facts come first, as the age of pictures is computed by the facts' clock."""
    return sorted({one.name: one for one in many}.values(), key=lambda one: one.kind != FACTS)
