"""Frames that differ from a first frame only by the poses of some objects (movers), so that only these cost time.

A camera makes one `Movers` with the objects that may move. Each new frame has only the movers' numbers (n + m, 20).
First come n rows, one for each primitive of the movers (see `kinds.layout`), grouped by object and ordered by kind.
Then come m rows, one for each mover: position, rotation and velocity. All other objects are as in the first frame.
"""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.surroundings.kinds.layout import NUMBERS, rows
from robot_side.surroundings.perceived import KINDS, PerceivedObjects, UnknownSpace
from robot_side.surroundings.placing import numbers_of, primitives_of

OF_OBJECTS: Final = {"positions_m": (3,), "rotations": (3, 3), "velocities_m_s": (3,)}
"""Arrays of a frame that have a row for each object, and the shape of a row, in the order of an object's numbers"""


_POINTS: Final = (
    "sphere_centers_m",
    "box_centers_m",
    "tetrahedron_vertices_m",
    "mesh_positions_m",
    "ellipsoid_centers_m",
)
"""Arrays of a frame that hold points"""


class Part(NamedTuple):
    """Where the values of one array of a frame are among the movers' numbers."""

    places: IntArray
    """(r,) rows of the movers' numbers"""
    rows: IntArray
    """(r,) rows of the frame's array, in the same order"""
    columns: slice
    shape: tuple[int, ...]


class Movers:
    """Objects of one frame that may be elsewhere in later frames."""

    def __init__(self, first: PerceivedObjects, things: IntArray) -> None:
        """things (m,): indices of the objects in the names of `first`, rising.

        ValueError for other indices, or if `first` is itself a frame of movers.
        """
        if first.since is not None:
            raise ValueError("first is a frame of changes; valid: a complete frame, with since = None")
        beyond = things.size > 0 and (things[0] < 0 or things[-1] >= len(first.names))
        if beyond or (np.diff(things) <= 0).any():
            raise ValueError(f"things = {things}; valid: rising indices from 0 to {len(first.names) - 1}")
        self.first = first
        self.things = things
        self.measured = first.velocities_m_s is not None
        owners, kinds, rows_of_kind = primitives_of(first)
        own = np.flatnonzero(np.isin(owners, things))
        self._own = own[np.argsort(owners[own], kind="stable")]
        """(n,) indices of the movers' primitives among all primitives of the frame"""
        self.first_rows = np.searchsorted(owners[self._own], np.append(things, len(first.names)))
        self.parts = self._all_parts(kinds[self._own], rows_of_kind[self._own])
        made_whole = {*self.parts, "time_s", "roles", "since", "unseen_m", "late_s", "sds_m", "surfaces", "unknown"}
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
        """Return the movers' numbers (n + m, 20) in a frame of the same objects; NaN for unknown poses, velocities."""
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

    def displaced(self, by_m: FloatArray) -> FloatArray:
        """Return the movers' numbers (n + m, 20) with each mover `by_m` (m, 3) from where it is in `first`."""
        numbers, owners = self.at_first.copy(), np.repeat(np.arange(len(self.things)), np.diff(self.first_rows))
        for name in _POINTS:
            places, _, columns, _ = self.parts[name]
            points = numbers[places, columns]
            numbers[places, columns] = points + np.tile(by_m[owners[places]], points.shape[1] // 3)
        places, _, columns, _ = self.parts["half_space_normals"]
        along = (numbers[places, columns] * by_m[owners[places]]).sum(axis=1)
        numbers[places, self.parts["half_space_offsets_m"].columns] += along[:, None]
        numbers[len(owners) :, :3] += by_m
        return numbers

    def frame(
        self,
        time_s: float,
        numbers: FloatArray,
        roles: tuple[Role, ...],
        unseen_m: float = 0.0,
        late_s: float = 0.0,
        sds_m: FloatArray | None = None,
        surfaces: IntArray | None = None,
        unknown: UnknownSpace | None = None,
    ) -> PerceivedObjects:
        """Return a new frame: the movers have these numbers (n + m, 20), all other objects are as in the first frame.

        roles: of all objects. unseen_m, late_s, unknown: as in a frame. sds_m, surfaces: of all objects; None: as in
        the first frame.
        ValueError for numbers of another shape or type, or for another number of roles or of surfaces.
        """
        shape = len(self._own) + len(self.things), NUMBERS
        if numbers.shape != shape or numbers.dtype != np.float64 or not numbers.flags.c_contiguous:
            raise ValueError(
                f"numbers is {numbers.dtype} in the shape {numbers.shape};"
                f" valid: contiguous float64 in the shape {shape}"
            )
        if len(roles) != len(self.first.names):
            raise ValueError(f"roles holds {len(roles)} roles; valid: one for each of {len(self.first.names)} objects")
        said = {"time_s": time_s, "roles": roles, "unseen_m": unseen_m, "late_s": late_s, "unknown": unknown}
        said["sds_m"] = self.first.sds_m if sds_m is None else sds_m
        said["surfaces"] = self.first.surfaces if surfaces is None else surfaces
        return _MoversFrame(**self._still, **said, since=(self, numbers))


class _MoversFrame(PerceivedObjects):
    """Frame that a `Movers` made; each array is built when it is first read."""

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
