"""Frames that differ from an earlier one by where some objects are: their cost is that of what moves.

A camera makes a `Movers` of the objects that may move, and a small frame of these alone whenever it looks. What the
others are, and where, is said once.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Final

import numpy as np

from common.arrays import IntArray
from robot_side.surroundings.perceived import KINDS, PerceivedObjects, Role, SomeObjects

OF_OBJECTS: Final = ("positions_m", "rotations", "velocities_m_s")
"""The arrays of a frame with a row for each object."""


class Movers(SomeObjects):
    """The objects of one frame that may be elsewhere in the next ones."""

    def __init__(self, first: PerceivedObjects, things: IntArray) -> None:
        """things (m,): their places among the names of `first`, rising. ValueError for others, or if `first` is made
        of an earlier one itself."""
        if first.since is not None:
            raise ValueError("first says only what is new since an earlier frame; valid: a frame that says all")
        beyond = things.size > 0 and (things[0] < 0 or things[-1] >= len(first.names))
        if beyond or (np.diff(things) <= 0).any():
            raise ValueError(f"things holds {things}; valid: rising places among {len(first.names)} objects")
        self.first = first
        self.things = things
        self.rows: Mapping[str, IntArray] = {
            kind.owner: np.flatnonzero(np.isin(getattr(first, kind.owner), things)) for kind in KINDS
        }
        """By the name of a kind's owners the rows (r,) of the primitives of these objects."""
        self._owners = {name: np.searchsorted(things, getattr(first, name)[rows]) for name, rows in self.rows.items()}

    def place_of(self, thing: int) -> int | None:
        """Which of the movers an object is; None for one that stands still."""
        place = int(np.searchsorted(self.things, thing))
        return place if place < len(self.things) and self.things[place] == thing else None

    @cached_property
    def at_first(self) -> PerceivedObjects:
        """The movers alone, as they are in `first`."""
        first, things = self.first, self.things
        arrays: dict[str, Any] = dict(self._owners)
        for kind in KINDS:
            rows = self.rows[kind.owner]
            arrays |= {array.name: getattr(first, array.name)[rows] for array in kind.arrays}
        for name in OF_OBJECTS:
            values = getattr(first, name)
            arrays[name] = None if values is None else values[things]
        return PerceivedObjects(
            time_s=first.time_s,
            names=tuple(first.names[thing] for thing in things),
            roles=tuple(first.roles[thing] for thing in things),
            mesh_library=first.mesh_library,
            **arrays,
        )

    def frame(self, moved: PerceivedObjects, roles: tuple[Role, ...]) -> PerceivedObjects:
        """The next frame: the movers as they are in `moved`, which has no others, all else as in the first.

        roles: of all objects. ValueError unless `moved` has the movers' primitives in the order of the first frame's.
        """
        for name, owners in self._owners.items():
            theirs = getattr(moved, name)
            if theirs is not owners and not np.array_equal(theirs, owners):
                raise ValueError(f"moved.{name} holds {theirs}; valid: {owners}, as in the first frame")
        if not np.array_equal(moved.mesh_index, self.at_first.mesh_index):
            raise ValueError(f"moved.mesh_index holds {moved.mesh_index}; valid: {self.at_first.mesh_index}")
        if len(roles) != len(self.first.names):
            raise ValueError(f"roles holds {len(roles)}; valid: one for each of {len(self.first.names)} objects")
        frame = object.__new__(_Elsewhere)
        whole = {name: value for name, value in vars(self.first).items() if name not in _MADE_WHOLE}
        vars(frame).update(whole, time_s=moved.time_s, roles=roles, since=(self, moved))
        return frame


class _Elsewhere(PerceivedObjects):
    """Such a frame: each array is made whole when somebody reads it first."""


def _whole(name: str, owner: str | None) -> Callable[[_Elsewhere], Any]:
    def made(frame: _Elsewhere) -> Any:
        if frame.since is None:
            raise AttributeError(name)
        movers, moved = frame.since
        at_first, values = getattr(movers.first, name), getattr(moved, name)
        if at_first is None or values is None:
            return None
        whole = at_first.copy()
        whole[movers.things if owner is None else movers.rows[owner]] = values
        return whole

    return made


_MADE_WHOLE: Final = {name: kind.owner for kind in KINDS for name in kind.fields} | dict.fromkeys(OF_OBJECTS)
for _name, _owner in _MADE_WHOLE.items():
    _property = cached_property(_whole(_name, _owner))
    _property.__set_name__(_Elsewhere, _name)
    setattr(_Elsewhere, _name, _property)
