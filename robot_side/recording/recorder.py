"""Recording of the core's inputs and messages, so that a replay can compute the run again bit for bit.

In a tick, recording costs only an append to a list; the notes are encoded in idle time (common/recording/side.py).
"""

import struct
from collections.abc import Callable
from typing import Any, Final

import msgspec

from common.episode import EpisodeMark
from common.recording.entries import Kind, entry, text
from robot_side.arm.port import ArmState
from robot_side.recording.arm_states import pack_state
from robot_side.recording.frames import FramePacker
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.tick.events import Listener, Tick

_HAPTICS: Final = b"haptics"


class RobotRecorder(Listener):
    """Listener that gives each payload and each tick to the function `note`."""

    def __init__(self, note: Callable[[Any], None]) -> None:
        self._note = note

    def on_received(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Note a payload."""
        self._note((Kind.RECEIVED, now_s, peer, payload))

    def on_episode(self, mark: EpisodeMark, now_s: float) -> None:
        """Note a mark of an episode."""
        self._note((Kind.EPISODE, now_s, mark))

    def on_tick(self, tick: Tick) -> None:
        """Note a tick, even a failed one."""
        self._note(tick)


class RobotEncoder:
    """Encoder of the recorder's notes as entries of a recording."""

    def __init__(self) -> None:
        self._frames = FramePacker()
        self._state: ArmState | None = None
        self._frame: PerceivedObjects | None = None

    def begin_epoch(self) -> None:
        """Encode the next state and the next frame as a whole."""
        self._frames.begin_epoch()
        self._state = self._frame = None

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        """Return the time of a note, and its entries."""
        del views  # recorded as they are sent (turns.py)
        if not isinstance(noted, Tick):
            kind, now_s, *content = noted
            parts = (
                [msgspec.json.encode(*content)]
                if kind in (Kind.EPISODE, Kind.TRUTH)
                else [text(content[0]), content[1]]
            )
            return now_s, entry(kind, now_s, *parts)
        now_s, state, frame, sent_s, outgoing, _ = noted
        parts = []
        if state is not None and state is not self._state:
            self._state = state
            parts.append(entry(Kind.STATE, now_s, pack_state(state)))
        if frame is not None and frame is not self._frame:
            self._frame = frame
            parts.append(entry(Kind.FRAME, now_s, self._frames.pack(frame)))
        parts.append(entry(Kind.TICK, now_s, struct.pack("<d", sent_s)))
        for message in outgoing:
            parts.append(entry(Kind.SENT, now_s, text(_HAPTICS), text(message.peer), message.payload))
        return now_s, b"".join(parts)
