"""Recording of all inputs and outputs of the core, so that a replay computes the same bits."""

from collections.abc import Callable, Sequence
from typing import Any, Final

import msgspec

from common.clock import clock_domain
from common.protocol.codec import MAXIMUM_BYTES
from common.recording.entries import Kind, entry, text
from common.recording.provenance import provenance
from common.recording.side import SideRecording
from operator_side.assembly import build_operator_side
from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState
from operator_side.core import OperatorSide
from operator_side.events import Input, Listener
from operator_side.robot_link.commanding import ToRobot
from operator_side.settings import OperatorSettings

_HAPTICS: Final = text(b"haptics")
_NOBODY: Final = text(b"")
_KINDS: Final[dict[Input, Kind]] = {
    "received": Kind.RECEIVED,
    "seen": Kind.SEEN,
    "state": Kind.HANDS,
    "tuned": Kind.TUNED,
    "calibrated": Kind.CALIBRATED,
    "found": Kind.FOUND,
    "lost": Kind.LOST,
    "stopped": Kind.STOPPED,
    "marked": Kind.MARKED,
    "episode": Kind.EPISODE,
}


class OperatorRecorder(Listener):
    """Listener that passes each input and output of the core to `note`."""

    def __init__(self, note: Callable[[Any], None]) -> None:
        self._note = note
        self._now_s = 0.0

    def on_input(self, what: Input, content: object, now_s: float | None) -> None:
        """Note an input; an input without a time gets the time of the last output."""
        kept = content if isinstance(content, bytes | ControllerState) else msgspec.json.encode(content)
        self._note((_KINDS[what], self._now_s if now_s is None else now_s, kept))

    def on_motion(self, messages: Sequence[ToRobot], now_s: float) -> None:
        """Note the messages to the robot side."""
        self._note((Kind.MOTION, now_s, messages))

    def on_output(self, feel: Feel | None, now_s: float) -> None:
        """Note the effects to write, and that they were asked for."""
        self._now_s = now_s
        self._note((Kind.OUTPUT, now_s, feel))


class OperatorEncoder:
    """Encodes the notes of `OperatorRecorder` as entries of a recording."""

    def begin_epoch(self) -> None:
        """Do nothing, as each entry can be read without earlier ones."""

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        """Return a note's time and its encoded entries; also pass a view payload to `views`."""
        kind, now_s, content = noted
        if kind == Kind.MOTION:
            sent = [entry(Kind.SENT, now_s, _HAPTICS, _NOBODY, message.payload) for message in content]
            return now_s, b"".join((entry(kind, now_s), *sent))
        if kind == Kind.OUTPUT:
            asked = entry(kind, now_s)
            encoded = b"" if content is None else entry(Kind.TOLD, now_s, msgspec.msgpack.encode(content))
            return now_s, asked + encoded
        if kind == Kind.SEEN:
            views(now_s, content)
            if len(content) > MAXIMUM_BYTES:  # a picture, which the core ignores
                return now_s, b""
        sender = [_NOBODY] if kind == Kind.RECEIVED else []
        return now_s, entry(kind, now_s, *sender, msgspec.msgpack.encode(content) if kind == Kind.HANDS else content)


def build_recorded(settings: OperatorSettings, epoch: int, recording: SideRecording | None) -> OperatorSide:
    """Build the core from `settings`; record its inputs and outputs if there is a `recording`."""
    if recording is None:
        return build_operator_side(settings, epoch, clock_domain())
    core = build_operator_side(settings, epoch, clock_domain(), [OperatorRecorder(recording.noted.append)])
    recording.begin(provenance(settings, epoch, clock_domain()))
    return core
