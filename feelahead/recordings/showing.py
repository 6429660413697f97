"""A recording shown once more: the facts and views that people saw, in order."""

from collections.abc import Iterator
from typing import Final, NamedTuple

import msgspec

from common.errors import RemoteProtocolError
from common.protocol.codec import decode_view, encode
from common.protocol.view_messages import SceneState, VideoFrame
from common.recording.images import read_image
from common.recording.reading import Message, Recording

FACTS: Final = b"f"
VIEW: Final = b"v"
ROBOT: Final = b"s"
_NANOSECONDS: Final = 1e-9
_TOPICS: Final = ("/robot/status", "/operator/facts", "/view", "/camera/overview", "/camera/first_person")


class Seen(NamedTuple):
    """One thing for the console."""

    time_s: float
    """Since the recording began"""
    kind: bytes
    """FACTS: OperatorFacts as JSON. VIEW: a view payload. ROBOT: the robot side's status as JSON."""
    name: str
    """The name: the newest of each replaces all earlier ones"""
    content: bytes


def seen(recording: Recording) -> Iterator[Seen]:
    """All that can be shown, in order; pictures are put back into their payloads."""
    began_ns = recording.began_ns()
    pictures: dict[tuple[str, int], bytes] = {}
    for message in recording.messages(_TOPICS):
        time_s = _NANOSECONDS * (message.log_ns - began_ns)
        if message.topic == "/operator/facts":
            yield Seen(time_s, FACTS, message.topic, message.content)
        elif message.topic == "/robot/status":
            yield Seen(time_s, ROBOT, message.topic, message.content)
        elif message.topic == "/view":
            yield Seen(time_s, VIEW, *_view(message, pictures))
        else:
            image = read_image(message.content)
            pictures = {(image.view, message.log_ns): image.jpeg, **dict(list(pictures.items())[:8])}


def _view(message: Message, pictures: dict[tuple[str, int], bytes]) -> tuple[str, bytes]:
    """Return the view's name and its payload as sent."""
    try:
        view = decode_view(message.content)
    except RemoteProtocolError:
        return "telemetry", message.content  # or of another version
    if not isinstance(view, VideoFrame):
        return "state" if isinstance(view, SceneState) else "shapes", message.content
    jpeg = pictures.get((view.view, message.log_ns), b"")
    return view.view, encode(msgspec.structs.replace(view, jpeg=jpeg))
