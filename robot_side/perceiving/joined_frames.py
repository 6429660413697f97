"""Frames of two sources as one frame, whose movers are those of the first and all objects of the second."""

import numpy as np

from common.arrays import FloatArray
from robot_side.surroundings.fixed_objects import joined
from robot_side.surroundings.kinds.layout import NUMBERS, rows
from robot_side.surroundings.movers import OF_OBJECTS, Movers
from robot_side.surroundings.perceived import KINDS, PerceivedObjects
from robot_side.surroundings.placing import numbers_of, primitives_of


class JoinedFrames:
    """Maker of frames with the objects of a second source behind those of a first, whose frames have movers."""

    def __init__(self) -> None:
        self.names: dict[str, str] = {}
        """Names that the second source gives, by those that they have in a frame"""
        self._frames: tuple[PerceivedObjects, PerceivedObjects, PerceivedObjects] | None = None
        self._structure: tuple[object, ...] = ()
        self._movers: Movers | None = None

    def of(self, one: PerceivedObjects, other: PerceivedObjects) -> PerceivedObjects:
        """Return both as one frame: the same object for the same two. ValueError if `one` has no movers."""
        if self._frames is None or self._frames[0] is not one or self._frames[1] is not other:
            self._frames = one, other, self._joined(one, other)
        return self._frames[2]

    def _joined(self, one: PerceivedObjects, other: PerceivedObjects) -> PerceivedObjects:
        if one.since is None:
            raise ValueError("one.since is None; valid: a frame of movers")
        things, numbers = one.since[0].things, one.since[1]
        owned = (getattr(other, name).tobytes() for name in (*(kind.owner for kind in KINDS), "mesh_index"))
        structure = one.since[0], other.names, other.mesh_library, *owned
        if self._movers is None or structure != self._structure:
            first, count = joined(one.since[0].first, other), len(one.names)
            self.names = dict(zip(first.names[count:], other.names, strict=True))
            self._movers = Movers(first, np.concatenate([things, np.arange(count, len(first.names))]))
            self._structure = structure
        poses = [_of_objects(other, name, shape) for name, shape in OF_OBJECTS.items()]
        parts = numbers_of(other)[np.argsort(primitives_of(other).owners, kind="stable")]
        boundary = len(numbers) - len(things)
        whole = np.concatenate([numbers[:boundary], parts, numbers[boundary:], rows(*poses, width=NUMBERS)])
        both = one, other
        sds_m = [np.full(len(each.names), np.nan) if each.sds_m is None else each.sds_m for each in both]
        alone = [np.full(len(each.names), -1) if each.surfaces is None else each.surfaces for each in both]
        return self._movers.frame(
            min(one.time_s, other.time_s),
            np.ascontiguousarray(whole),
            one.roles + other.roles,
            max(one.unseen_m, other.unseen_m),
            max(one.late_s, other.late_s),
            np.concatenate(sds_m),
            np.concatenate(alone),
            one.unknown,
        )


def _of_objects(frame: PerceivedObjects, name: str, shape: tuple[int, ...]) -> FloatArray:
    values: FloatArray | None = getattr(frame, name)
    return np.zeros((len(frame.names), *shape)) if values is None else values
