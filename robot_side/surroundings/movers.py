"""Frames that differ from an earlier one by the poses of some objects: only the objects that move cost time.

A camera makes one `Movers` of the objects that may move. Each new frame brings only the numbers of these. First come n
rows of 20, one for each of their primitives (see `kinds.layout`), grouped by object and ordered by kind. Then come m
rows, one for each object: position, rotation and velocity. The first frame has all other objects.
"""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.surroundings.kinds.layout import NUMBERS, rows
from robot_side.surroundings.perceived import KINDS, PerceivedObjects
from robot_side.surroundings.placing import numbers_of, primitives_of

OF_OBJECTS: Final = {"positions_m": (3,), "rotations": (3, 3), "velocities_m_s": (3,)}
"""Arrays of a frame with a row for each object, in the order of the object's numbers"""


class Part(NamedTuple):
    """Places of the values of a frame's array among the movers' numbers."""

    places: IntArray
    """(r,) rows of the numbers"""
    rows: IntArray
    """(r,) rows of the array"""
    columns: slice
    shape: tuple[int, ...]


class Movers:
    """Objects of one frame that may be elsewhere in later frames."""

    def __init__(self, first: PerceivedObjects, things: IntArray) -> None:
        """things (m,): indices into the names of `first`, rising. ValueError for other indices, or if `first` is
        itself a frame of movers."""
        if first.since is not None:
            raise ValueError("first is itself a frame of movers; valid: a complete frame")
        beyond = things.size > 0 and (things[0] < 0 or things[-1] >= len(first.names))
        if beyond or (np.diff(things) <= 0).any():
            raise ValueError(f"things holds {things}; valid: rising places among {len(first.names)} objects")
        self.first = first
        self.things = things
        self.measured = first.velocities_m_s is not None
        owners, kinds, rows_of_kind = primitives_of(first)
        own = np.flatnonzero(np.isin(owners, things))
        self._own = own[np.argsort(owners[own], kind="stable")]
        """(n,) indices into all primitives of the frame"""
        self.first_rows = np.searchsorted(owners[self._own], np.append(things, len(first.names)))
        self.parts = self._all_parts(kinds[self._own], rows_of_kind[self._own])
        made_whole = {*self.parts, "time_s", "roles", "since"}
        self._still = {name: value for name, value in vars(first).items() if name not in made_whole}

    def _all_parts(self, kinds: IntArray, rows_of_kind: IntArray) -> Mapping[str, Part]:
        parts, count = {}, len(kinds)
        for number, kind in enumerate(KINDS):
            places = np.flatnonzero(kinds == number)
            for name, where in kind.parts.items():
                parts[name] = Part(places, rows_of_kind[places], *where)
        end = 0
        for name, shape in OF_OBJECTS.items():
            end, begin = end + math.prod(shape), end
            parts[name] = Part(np.arange(count, count + len(self.things)), self.things, slice(begin, end), shape)
        return parts

    def numbers_in(self, objects: PerceivedObjects) -> FloatArray:
        """Return the movers' numbers in a frame of the same objects; NaN for unknown poses and velocities."""
        of_objects = [getattr(objects, name) for name in OF_OBJECTS]
        shapes = OF_OBJECTS.values()
        count = len(self.things)
        known = [
            np.full((count, *shape), np.nan) if values is None else values[self.things]
            for values, shape in zip(of_objects, shapes, strict=True)
        ]
        return np.concatenate([numbers_of(objects)[self._own], rows(*known, width=NUMBERS)])

    @cached_property
    def at_first(self) -> FloatArray:
        """Numbers of the movers in `first`"""
        return self.numbers_in(self.first)

    def frame(self, time_s: float, numbers: FloatArray, roles: tuple[Role, ...]) -> PerceivedObjects:
        """Return a new frame: the movers by their numbers, all else as in the first frame.

        roles: of all objects. ValueError for another number of rows or roles.
        """
        shape = len(self._own) + len(self.things), NUMBERS
        if numbers.shape != shape or numbers.dtype != np.float64 or not numbers.flags.c_contiguous:
            raise ValueError(f"numbers holds {numbers.dtype} {numbers.shape}; valid: contiguous float64 {shape}")
        if len(roles) != len(self.first.names):
            raise ValueError(f"roles holds {len(roles)}; valid: one for each of {len(self.first.names)} objects")
        return _MoversFrame(**self._still, time_s=time_s, roles=roles, since=(self, numbers))


class _MoversFrame(PerceivedObjects):
    """Frame of movers; each array is built on first read."""

    def __init__(self, **said: Any) -> None:
        vars(self).update(said)

    def __getattr__(self, name: str) -> Any:
        """Build the array `name`; AttributeError for any other name."""
        if self.since is None or name not in self.since[0].parts:
            raise AttributeError(name)
        movers, numbers = self.since
        at_first = getattr(movers.first, name)
        if at_first is not None:
            places, rows_there, columns, shape = movers.parts[name]
            whole = at_first.copy()
            whole[rows_there] = numbers[places, columns].reshape(-1, *shape)
            at_first = whole
        vars(self)[name] = at_first
        return at_first
