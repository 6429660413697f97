"""Perceived objects from a separate process, written in any language."""

import math
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, Literal

import msgspec
import numpy as np

from common.errors import FeelaheadError, OtherVersionError, RemoteProtocolError
from common.roles import Role
from robot_side.drivers.remote.arm import Wire
from robot_side.drivers.remote.frame_age import CarriedFrame
from robot_side.drivers.remote.frame_build import AT_ONCE, Arrays, Known, ReadObjects, read_in_steps
from robot_side.drivers.remote.frame_message import (
    DEFINES_MESHES,
    FRAME_VERSION,
    MOST_OBJECTS,
    FrameRefusal,
    ObjectFrame,
    UnknownMeshError,
    read_frame,
    read_mesh,
)
from robot_side.drivers.remote.messages import Heard
from robot_side.drivers.remote.sender_clock import UNBOUNDED_S, SenderClock
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.roles import role_from_name
from robot_side.surroundings.validity import require_valid

OLD_S: Final = 0.5
"""Age of the newest frame, in seconds, above which a note is made. The frame stays valid, so triggers stay stiff."""
_REFUSAL_PERIOD_S: Final = 1.0
_MOST_WAITING: Final = 16
"""Maximum number of frames that wait because they define meshes; others are overtaken by newer ones"""

Why = Literal["second", "version", "malformed", "order", "clock", "mesh"]
_Waiting = tuple[bytes, bytes, float]
"""Peer, payload, and time of reception"""


def _unprepared(frame: PerceivedObjects) -> object:
    return frame


class RemoteObjects:
    """Source of perceived objects: the newest valid frame, from one sender at a time.

    A frame is read in steps, one in each call of `exchange`, so that a large one holds up no turn.
    """

    def __init__(
        self,
        wire: Wire,
        roles: Mapping[str, Role],
        note: Callable[[str], None],
        *,
        unseen_m_s: float = 0.0,
        prepare: Callable[[PerceivedObjects], object] = _unprepared,
    ) -> None:
        """roles: by name, before those in frames. note: called with each fault's line.

        unseen_m_s: speed at which anything may move unseen. prepare: called with each frame before it is perceived, in
        a step of its own.
        """
        self.rejected: Counter[Why] = Counter()
        """Number of rejected frames by reason; a frame is rejected as a whole."""
        self.accepted = 0
        self._wire, self._roles, self._note = wire, dict(roles), note
        self._unseen_m_s, self._prepare = unseen_m_s, prepare
        self._peer: bytes | None = None
        self._sequence = -1
        self._heard_s = self._refused_s = -math.inf
        self._clock = SenderClock()
        self._waiting: deque[_Waiting] = deque()
        self._steps: Iterator[None] | None = None
        self._frame: CarriedFrame | None = None
        self._known = Known(MOST_OBJECTS)
        # A robot side without sent objects does not load the kernels for meshes.
        from robot_side.drivers.remote.sent_meshes import SentMeshes, prepared  # noqa: PLC0415

        self._meshes, self._prepared_mesh = SentMeshes(), prepared
        self._said: set[str] = set()
        self._is_old = False

    @property
    def busy(self) -> bool:
        """Whether a frame has come that is not perceived yet"""
        return self._steps is not None or bool(self._waiting)

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`, carried on to then; FeelaheadError before the first frame."""
        if not self.exchange(now_s) or self._frame is None:
            raise FeelaheadError("no objects have been perceived yet")
        return self._frame.at(now_s)

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of the object `name` from the next frame on."""
        self._roles[name] = role

    def exchange(self, now_s: float) -> bool:
        """Take the frames that have arrived, and read on by a step; return whether there has ever been a frame."""
        for message in self._wire.receive():
            self._queue(message)
        if self._steps is None and self._waiting:
            self._steps = self._read(*self._waiting.popleft(), now_s)
        if self._steps is not None and next(self._steps, self) is self:
            self._steps = None
        if self._frame is None:
            return False
        age_s = now_s - self._frame.taken_s[1]
        if (age_s > OLD_S) is not self._is_old:
            self._is_old = age_s > OLD_S
            age = f"the newest frame is {age_s:.1f} s old; its objects stay valid"
            self._note(f"objects: {age if self._is_old else 'frames arrive again'}")
        return True

    def summary(self) -> dict[str, int]:
        """Return the number of accepted frames, and of rejected frames by reason."""
        return {"accepted": self.accepted} | {str(why): count for why, count in self.rejected.items()}

    def _queue(self, message: _Waiting) -> None:
        """Let a message wait; it overtakes those of the same peer that define no meshes."""
        peer = message[0]
        kept = [one for one in self._waiting if one[0] != peer or DEFINES_MESHES in one[1]]
        self._waiting = deque([*kept[-_MOST_WAITING:], message])

    def _read(self, peer: bytes, payload: bytes, received_s: float, now_s: float) -> Iterator[None]:
        """Read a frame in steps; a fault rejects it as a whole."""
        try:
            frame = self._begin(peer, payload, received_s, now_s)
            if frame is not None:
                yield from self._take(frame, peer, received_s)
        except OtherVersionError as error:
            self._reject("version", str(error), peer, received_s)
        except (RemoteProtocolError, ValueError) as error:
            unknown = error.names if isinstance(error, UnknownMeshError) else ()
            self._reject("mesh" if unknown else "malformed", str(error), peer, received_s, unknown)

    def _begin(self, peer: bytes, payload: bytes, received_s: float, now_s: float) -> ObjectFrame | None:
        """Return the frame, if it is in time, and its sender the one who sends."""
        silent = received_s - self._heard_s > OLD_S
        if peer != self._peer and not silent:
            why = "a second perception sends, while the first one still does; valid: one at a time"
            self._reject("second", why, peer, received_s)
            return None
        frame = read_frame(payload)
        if peer == self._peer and frame.sequence <= self._sequence and not silent:
            why = f"sequence = {frame.sequence}; valid: above that of the frame before, {self._sequence}"
            self._reject("order", why, peer, received_s)
            return None
        if peer != self._peer or frame.sequence <= self._sequence:
            self._clock = SenderClock()
        if not self._clock.update(frame, received_s):
            self._clock = SenderClock()
            why = "the sender's clock jumped, or echo_s and held_s are not from our answers"
            self._reject("clock", why, peer, received_s)
            return None
        self._answer(frame, peer, now_s)
        return frame

    def _answer(self, frame: ObjectFrame, peer: bytes, now_s: float) -> None:
        """Send what the sender echoes, if it does."""
        if self._clock.answers(frame, now_s):
            self._wire.send(peer, msgspec.msgpack.encode(Heard(FRAME_VERSION, now_s)))
        if self._clock.stays_unbounded(frame):
            text = f"the age of frames is not bounded, as none echoes an answer: each counts as {UNBOUNDED_S} s older"
            self._report_once("echo", f"objects: {text} (docs/drivers.md)")

    def _take(self, frame: ObjectFrame, peer: bytes, received_s: float) -> Iterator[None]:
        """Take a frame in steps; ValueError or RemoteProtocolError if it is invalid."""
        new: dict[str, Any] = {}
        for name in frame.meshes:
            new[name] = self._prepared_mesh(name, read_mesh(frame, name))
            yield
        meshes = self._meshes.and_also(new)
        read: ReadObjects | None = None
        for read in read_in_steps(frame):
            if read is None:
                yield
        if read is None:
            return
        taken_s = self._clock.taken_s(frame, received_s)
        unknown = tuple(dict.fromkeys(name for name in read.meshes if name not in meshes.index))
        if unknown:
            raise UnknownMeshError(unknown)
        placed = np.array([meshes.index[name] for name in read.meshes], dtype=np.int64)
        shapes: Arrays = {"mesh_library": meshes.library, "mesh_index": placed}
        seen = self._known.frame(read, self.accepted, self._role, taken_s[1], shapes)
        require_valid(seen)
        carried = CarriedFrame(seen, taken_s, self._unseen_m_s)
        if len(seen.names) > AT_ONCE:
            yield
            self._prepare(seen)
            yield
        self._prepare(carried.at(received_s))
        self._frame, self._meshes = carried, meshes
        self.accepted += 1
        self._peer, self._sequence, self._heard_s = peer, frame.sequence, received_s

    def _role(self, name: str, sent: Role | None) -> Role:
        return self._roles.get(name) or sent or role_from_name(name)

    def _report_once(self, about: str, text: str) -> None:
        if about not in self._said:
            self._said.add(about)
            self._note(text)

    def _reject(self, why: Why, text: str, peer: bytes, now_s: float, unknown: tuple[str, ...] = ()) -> None:
        self.rejected[why] += 1
        self._report_once(
            why, f"objects: a frame was refused as a whole: {text} (further frames with this fault are only counted)"
        )
        if now_s - self._refused_s >= _REFUSAL_PERIOD_S:
            self._refused_s = now_s
            self._wire.send(peer, msgspec.msgpack.encode(FrameRefusal(FRAME_VERSION, text, unknown)))
