"""Many objects that come as frames of a perception process, without a socket: for the cost of reading them."""

from typing import Final

import msgspec

from common.roles import Role
from feelahead.lab.tick.crowd import crowd
from robot_side.drivers.remote.frame_message import FRAME_VERSION
from robot_side.drivers.remote.objects import RemoteObjects
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings

_PERIOD_S: Final = 0.1
_UNSEEN_M_S: Final = 0.02


class SentCamera:
    """ObjectSource of objects around the table, out of the gripper's reach, that are sent once or at 10 Hz."""

    def __init__(self, count: int, surroundings: Surroundings, *, again: bool) -> None:
        """again: whether frames follow the first."""
        self._again, self._sequence, self._next_s, self._now_s = again, 0, -1.0, 0.0
        seen = crowd(count, 0.0)
        balls = zip(seen.sphere_object.tolist(), seen.sphere_centers_m, seen.sphere_radii_m.tolist(), strict=True)
        boxes = zip(seen.box_object.tolist(), seen.box_centers_m, seen.box_half_sizes_m, strict=True)
        corners = zip(seen.tetrahedron_object.tolist(), seen.tetrahedron_vertices_m, strict=True)
        things = [{"name": f"crowd {k}", "position_m": at.tolist(), "sphere": radius} for k, at, radius in balls]
        things += [{"name": f"crowd {k}", "position_m": at.tolist(), "box": half.tolist()} for k, at, half in boxes]
        things += [{"name": f"crowd {k}", "tetrahedra": [four.tolist()]} for k, four in corners]
        self._things = msgspec.Raw(msgspec.msgpack.encode(things))
        # Frames are as a process of its own would send them: packed by no time of this one.
        self._objects = RemoteObjects(self, {}, lambda _: None, unseen_m_s=_UNSEEN_M_S, prepare=surroundings.see)
        while not self._objects.exchange(0.0):
            pass

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        """Return a frame when one is due."""
        if self._now_s < self._next_s or (self._sequence > 0 and not self._again):
            return []
        self._sequence, self._next_s = self._sequence + 1, self._now_s + _PERIOD_S
        times = {"sent_s": self._now_s, "taken_s": self._now_s}
        frame = {"version": FRAME_VERSION, "sequence": self._sequence, **times, "objects": self._things}
        return [(b"eyes", msgspec.msgpack.encode(frame), self._now_s)]

    def send(self, peer: bytes, payload: bytes) -> bool:
        """Take an answer, which nobody reads."""
        del peer, payload
        return True

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame, and read on by a step."""
        self._now_s = now_s
        return self._objects.perceive(now_s)

    def set_role(self, name: str, role: Role) -> None:
        """Set the role of an object."""
        self._objects.set_role(name, role)
