"""A robot side that notes every input of its core and what it sent, to be made again bit for bit.

In a tick this costs an append; bytes are made of it in the idle time (common/recording/side.py).
"""

import functools
import math
import struct
from collections.abc import Callable
from typing import Any, Final

from common.recording.entries import Kind, entry, text
from common.recording.provenance import provenance
from common.recording.side import SideRecording
from robot_side.arm.port import ArmState
from robot_side.compiled.warm_up import kernel_digests
from robot_side.core import RobotSide
from robot_side.outgoing_messages import Outgoing
from robot_side.recorded_inputs import FramePacker, pack_state
from robot_side.settings import RobotSettings
from robot_side.surroundings.perceived import PerceivedObjects

_HAPTICS: Final = "haptics"
Note = Callable[[Any], None]


class RecordedRobotSide(RobotSide):
    """As the one that it extends; `note` takes what happened."""

    def __init__(self, note: Note, *parts: Any, **named: Any) -> None:
        super().__init__(*parts, **named)
        self._note = note

    def receive(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """As the core's."""
        self._note((now_s, peer, payload))
        super().receive(peer, payload, now_s)

    def tick(self, now_s: float) -> list[Outgoing]:
        """As the core's; a tick that fails is noted, too."""
        outgoing: list[Outgoing] = []
        try:
            outgoing = super().tick(now_s)
        finally:
            command = self.session.safety.command
            sent_s = math.nan if command is None else command.header.sent_s
            self._note((now_s, self._measured, self._frame, sent_s, outgoing))
        return outgoing


class RobotEncoder:
    """Turns these notes into entries."""

    def __init__(self) -> None:
        self._frames = FramePacker()
        self._state: ArmState | None = None
        self._frame: PerceivedObjects | None = None

    def begin_anew(self) -> None:
        """Tell state and frame whole the next time."""
        self._frames.begin_anew()
        self._state = self._frame = None

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        """When it happened, and its entries; telemetry goes to `views`."""
        if len(noted) == 3:
            now_s, peer, payload = noted
            return now_s, entry(Kind.RECEIVED, now_s, text(peer), payload)
        now_s, state, frame, sent_s, outgoing = noted
        parts = []
        if state is not None and state is not self._state:
            self._state = state
            parts.append(entry(Kind.STATE, now_s, pack_state(state)))
        if frame is not None and frame is not self._frame:
            self._frame = frame
            parts.append(entry(Kind.FRAME, now_s, self._frames.pack(frame)))
        parts.append(entry(Kind.TICK, now_s, struct.pack("<d", sent_s)))
        for message in outgoing:
            if message.stream == _HAPTICS:
                parts.append(entry(Kind.SENT, now_s, text(_HAPTICS.encode()), text(message.peer), message.payload))
            else:
                views(now_s, message.payload)
        return now_s, b"".join(parts)


def recorded_by(recording: SideRecording | None) -> Callable[..., RobotSide]:
    """What makes a core whose inputs go to `recording`; the plain one without a recording."""
    return RobotSide if recording is None else functools.partial(RecordedRobotSide, recording.noted.append)


def robot_header(settings: RobotSettings, epoch: int, clock_domain: str) -> dict[str, Any]:
    """What the core was made from; to be told once its kernels are there."""
    return provenance(settings, epoch, clock_domain) | {"kernels": kernel_digests()}


def recorded_status(core: RobotSide, now_s: float) -> dict[str, Any]:
    """What a person is shown, and the offset of the operator side's clock."""
    return core.status(now_s) | {"offset_s": core.session.link.clock_offset.offset_at(now_s)}
