"""Space that nobody has seen, as the law takes it: one object of boxes, which has half strength at most."""

from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.roles import Role
from robot_side.field.field import Ahead
from robot_side.field.object_class import OBSTACLE
from robot_side.laws.prospect import Asked
from robot_side.surroundings.fixed_objects import fixed_objects
from robot_side.surroundings.perceived import PerceivedObjects, UnknownSpace
from robot_side.surroundings.scene_table import SceneTable, make
from robot_side.tick.sensed import STRENGTHS

HALF: Final = STRENGTHS // 2
"""Greatest strength of what nobody has seen"""
_CLASSES: Final = np.array([OBSTACLE])


class UnknownAhead:
    """Looks at the unknown space of the newest frame."""

    def __init__(self, encoder_sigma_rad: FloatArray) -> None:
        self._ahead = Ahead(encoder_sigma_rad)
        self._made: tuple[UnknownSpace, SceneTable] | None = None

    def with_unknown_m(self, onsets_m: FloatArray, asked: Asked, unknown: UnknownSpace | None) -> FloatArray:
        """Return a look's onset distances (2, 8), up to half strength those of unknown space if it is nearer."""
        if unknown is None or not len(unknown.boxes_m):
            return onsets_m
        if self._made is None or self._made[0] is not unknown:
            self._made = unknown, make(_one_object(unknown.boxes_m))
        along = replace(asked.along, approach_m=None, of_objects=None)
        made = self._ahead.look(asked.pose, self._made[1], _CLASSES, along, asked.widest_m)
        both_m = onsets_m.copy()
        both_m[:, :HALF] = np.minimum(both_m[:, :HALF], made.onsets_m[:, :HALF])
        return both_m


def _one_object(boxes_m: FloatArray) -> PerceivedObjects:
    """Return a frame with one object of these boxes (u, 2, 3)."""
    count = len(boxes_m)
    return replace(
        fixed_objects(None, ()),
        names=("unknown",),
        roles=(Role.OBSTACLE,),
        box_centers_m=boxes_m.mean(axis=1),
        box_rotations=np.tile(np.eye(3), (count, 1, 1)),
        box_half_sizes_m=0.5 * (boxes_m[:, 1] - boxes_m[:, 0]),
        box_object=np.zeros(count, dtype=np.int64),
        positions_m=None,
        rotations=None,
        velocities_m_s=None,
        sds_m=None,
    )
