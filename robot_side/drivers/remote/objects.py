"""Perceived objects from a separate process, written in any language."""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final, Literal

from common.errors import FeelaheadError, OtherVersionError, RemoteProtocolError
from common.roles import Role
from robot_side.drivers.remote.arm import Wire
from robot_side.drivers.remote.frame_message import (
    FRAME_DECODER,
    FRAME_VERSION,
    MOST_OBJECTS,
    ObjectFrame,
    SeenObject,
    perceived,
    require_possible,
)
from robot_side.drivers.remote.messages import Refusal, decoded, encode
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.roles import role_from_name
from robot_side.surroundings.validity import require_valid

OLD_S: Final = 0.5
"""Age of the newest frame, in seconds, above which a note is made. The frame stays valid, so triggers stay stiff."""
_REFUSAL_PERIOD_S: Final = 1.0

Why = Literal["second", "version", "malformed", "order"]


class RemoteObjects:
    """Source of perceived objects: the newest valid frame, from one sender at a time."""

    def __init__(self, wire: Wire, roles: Mapping[str, Role], sd_m: float, note: Callable[[str], None]) -> None:
        """roles: by name, before those in frames. sd_m: σ_c that the law uses. note: called with each fault's line."""
        self.rejected: Counter[Why] = Counter()
        """Number of rejected frames by reason; a frame is rejected as a whole."""
        self.accepted = 0
        self._wire, self._roles, self._sd_m, self._note = wire, dict(roles), sd_m, note
        self._peer: bytes | None = None
        self._sequence = -1
        self._heard_s = self._taken_s = self._refused_s = -math.inf
        self._frame: PerceivedObjects | None = None
        self._known: list[SeenObject] = []
        """Each object as it was seen last, at its index in the frames"""
        self._last_seen: dict[str, int] = {}
        """Number of the frame that had each known object last"""
        self._said: set[str] = set()
        self._is_old = False

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`; FeelaheadError before the first frame."""
        if not self.exchange(now_s) or self._frame is None:
            raise FeelaheadError("no objects have been perceived yet")
        return self._frame

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of the object `name` from the next frame on."""
        self._roles[name] = role

    def exchange(self, now_s: float) -> bool:
        """Take the frames that have arrived; return whether there has ever been one."""
        newest = {peer: (payload, received_s) for peer, payload, received_s in self._wire.receive()}
        for peer, (payload, received_s) in newest.items():
            self._receive(peer, payload, received_s)
        old = self._frame is not None and now_s - self._taken_s > OLD_S
        if old is not self._is_old:
            self._is_old = old
            age = f"the newest frame is {now_s - self._taken_s:.1f} s old; its objects stay valid"
            self._note(f"objects: {age if old else 'frames arrive again'}")
        return self._frame is not None

    def summary(self) -> dict[str, int]:
        """Return the number of accepted frames, and of rejected frames by reason."""
        return {"accepted": self.accepted} | {str(why): count for why, count in self.rejected.items()}

    def _receive(self, peer: bytes, payload: bytes, received_s: float) -> None:
        if peer != self._peer and received_s - self._heard_s <= OLD_S:
            self._reject(
                "second",
                "a second perception sends, while the first one still does; valid: one at a time",
                peer,
                received_s,
            )
            return
        try:
            frame = decoded(payload, FRAME_DECODER, FRAME_VERSION)
            if peer == self._peer and frame.sequence <= self._sequence and received_s - self._heard_s <= OLD_S:
                why = f"sequence = {frame.sequence}; valid: above that of the frame before, {self._sequence}"
                self._reject("order", why, peer, received_s)
                return
            self._take(frame, received_s)
        except OtherVersionError as error:
            self._reject("version", str(error), peer, received_s)
        except (RemoteProtocolError, ValueError) as error:
            self._reject("malformed", str(error), peer, received_s)
        else:
            self.accepted += 1
            self._peer, self._sequence, self._heard_s = peer, frame.sequence, received_s

    def _take(self, frame: ObjectFrame, received_s: float) -> None:
        """Take a frame; ValueError if it is invalid."""
        require_possible(frame)
        known, present = self._placed(frame), {thing.name for thing in frame.objects}
        roles = [self._role(thing) if thing.name in present else Role.IGNORED for thing in known]
        taken_s = received_s - (frame.sent_s - frame.taken_s)
        seen = perceived(known, roles, taken_s)
        require_valid(seen)
        self._known, self._frame, self._taken_s = known, seen, taken_s
        names = {thing.name for thing in known}
        self._last_seen = {name: number for name, number in self._last_seen.items() if name in names}
        self._last_seen |= dict.fromkeys(present, self.accepted)
        widest = max(frame.objects, key=lambda thing: thing.sd_m, default=None)
        if widest is not None and widest.sd_m > self._sd_m:
            text = f"sd_m = {widest.sd_m} of {widest.name!r} is more than {self._sd_m}, which the law uses"
            self._report_once("sd", f"objects: {text}; to raise that: --camera.sd-m {widest.sd_m}")

    def _placed(self, frame: ObjectFrame) -> list[SeenObject]:
        """Return the known objects with those of the frame, each at its index.

        A missing object has no shape but keeps its name and index, as it may be held. If there is no room, a new object
        takes the index of the one that has been gone longest, whose name is forgotten.
        """
        seen = {thing.name: thing for thing in frame.objects}
        placed = [seen.pop(thing.name, thing) for thing in self._known]
        present = {thing.name for thing in frame.objects}
        new = list(seen.values())
        room = max(MOST_OBJECTS - len(placed), 0)
        if len(new) > room:
            gone = [index for index, thing in enumerate(placed) if thing.name not in present]
            gone.sort(key=lambda index: self._last_seen[placed[index].name])
            for index, thing in zip(gone, new[room:], strict=False):
                placed[index] = thing
        return placed + new[:room]

    def _role(self, thing: SeenObject) -> Role:
        return self._roles.get(thing.name) or thing.role or role_from_name(thing.name)

    def _report_once(self, about: str, text: str) -> None:
        if about not in self._said:
            self._said.add(about)
            self._note(text)

    def _reject(self, why: Why, text: str, peer: bytes, now_s: float) -> None:
        self.rejected[why] += 1
        self._report_once(
            why, f"objects: a frame was refused as a whole: {text} (further frames with this fault are only counted)"
        )
        if now_s - self._refused_s >= _REFUSAL_PERIOD_S:
            self._refused_s = now_s
            self._wire.send(peer, encode(Refusal(FRAME_VERSION, text)))
