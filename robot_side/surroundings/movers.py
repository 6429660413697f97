"""Frames that differ from an earlier one by where some objects are: their cost is that of what moves.

A camera makes a `Movers` of the objects that may move, and whenever it looks says the numbers of these alone: n rows of
20, one for each of their primitives (see `kinds.layout`), those of an object together and ordered by kind, and then m
rows, one for each object: its position, rotation and velocity. What the others are, and where, is said once.
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
"""The arrays of a frame with a row for each object, in the order of its numbers."""


class Part(NamedTuple):
    """Where the values of one of a frame's arrays are among the movers' numbers."""

    places: IntArray
    """(r,) the rows there"""
    rows: IntArray
    """(r,) and those of the array"""
    columns: slice
    shape: tuple[int, ...]


class Movers:
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
        self.measured = first.velocities_m_s is not None
        owners, kinds, rows_of_kind = primitives_of(first)
        own = np.flatnonzero(np.isin(owners, things))
        self._own = own[np.argsort(owners[own], kind="stable")]
        """(n,) of all primitives"""
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
        """The movers' numbers where a frame of the same objects has them; NaN for what it does not know."""
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
        """Their numbers in `first`."""
        return self.numbers_in(self.first)

    def frame(self, time_s: float, numbers: FloatArray, roles: tuple[Role, ...]) -> PerceivedObjects:
        """The next frame: the movers by their numbers, all else as in the first.

        roles: of all objects. ValueError for another number of either.
        """
        shape = len(self._own) + len(self.things), NUMBERS
        if numbers.shape != shape or numbers.dtype != np.float64 or not numbers.flags.c_contiguous:
            raise ValueError(f"numbers holds {numbers.dtype} {numbers.shape}; valid: contiguous float64 {shape}")
        if len(roles) != len(self.first.names):
            raise ValueError(f"roles holds {len(roles)}; valid: one for each of {len(self.first.names)} objects")
        return _Elsewhere(**self._still, time_s=time_s, roles=roles, since=(self, numbers))


class _Elsewhere(PerceivedObjects):
    """Such a frame: an array is made whole when somebody reads it first."""

    def __init__(self, **said: Any) -> None:
        vars(self).update(said)

    def __getattr__(self, name: str) -> Any:
        """Make the whole array of what is not there yet."""
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
