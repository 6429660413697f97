"""A recording shown once more: the facts and views that people saw, in order, at any speed."""

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import msgspec

from common.errors import RemoteProtocolError
from common.protocol.codec import decode_view, encode
from common.protocol.view_messages import VideoFrame
from common.recording.images import read_image
from common.recording.reading import Message, Recording

FACTS: Final = b"f"
VIEW: Final = b"v"
ROBOT: Final = b"s"
_NANOSECONDS: Final = 1e-9


class Seen(NamedTuple):
    """One thing for the console."""

    time_s: float
    """Since the recording began"""
    kind: bytes
    """FACTS: OperatorFacts as JSON. VIEW: a view payload. ROBOT: the robot side's status as JSON."""
    content: bytes


def seen(recording: Recording) -> Iterator[Seen]:
    """All that can be shown, in order; pictures are put back into their payloads."""
    began_ns = recording.began_ns()
    pictures: dict[tuple[str, int], bytes] = {}
    for message in recording.messages(
        ("/robot/status", "/operator/facts", "/view", "/camera/overview", "/camera/first_person")
    ):
        time_s = _NANOSECONDS * (message.log_ns - began_ns)
        if message.topic == "/operator/facts":
            yield Seen(time_s, FACTS, message.content)
        elif message.topic == "/robot/status":
            yield Seen(time_s, ROBOT, message.content)
        elif message.topic == "/view":
            yield Seen(time_s, VIEW, _with_picture(message, pictures))
        else:
            image = read_image(message.content)
            pictures = {(image.view, message.log_ns): image.jpeg, **dict(list(pictures.items())[:8])}


def show(
    recording: Recording,
    send: Callable[[bytes, bytes], None],
    wait: Callable[[float], bool],
    speed: float = 1.0,
) -> int:
    """Send everything to `send(kind, content)` when it is due; how much that was.

    `wait(seconds)` lets that much time pass, and says whether to go on.
    """
    shown, at_s = 0, 0.0
    for one in seen(recording):
        if one.time_s > at_s:
            if not wait((one.time_s - at_s) / speed):
                break
            at_s = one.time_s
        send(one.kind, one.content)
        shown += 1
    return shown


def _with_picture(message: Message, pictures: dict[tuple[str, int], bytes]) -> bytes:
    try:
        view = decode_view(message.content)
    except RemoteProtocolError:
        return message.content  # telemetry, or of another version
    if not isinstance(view, VideoFrame):
        return message.content
    jpeg = pictures.get((view.view, message.log_ns), b"")
    return encode(msgspec.structs.replace(view, jpeg=jpeg))
