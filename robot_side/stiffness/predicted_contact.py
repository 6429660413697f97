"""At which travel of each trigger the gripper would touch the target: the place of the detent that fingers feel.

A trigger pulled to the calibrated travel x moves the gripper at x v_max. The gripper, not enlarged, touches the
target within the horizon h = t_d + reaction, which is how long it goes on before a person who feels the bump has an
effect, from the travel x_c = distance / (v_max h) on; above 1 no pull touches that soon. Obstacles have no detent:
they are felt before contact, by a stiffness that has no cap.

The distance along the trigger's direction is exact but for a tenth of a millimetre: each sphere is moved on by a
lower bound of what is left until it touches (sphere tracing; for a convex primitive by the way to the plane that
touches it at its nearest point, which needs fewer steps).
"""

import math
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.arm.port import GripperPose
from robot_side.compiled.kernel import COUNT, NUMBER, compiled, input_array, output_array
from robot_side.compiled.vectors import dot, load
from robot_side.objects.perceived import PerceivedObjects
from robot_side.pairs.candidates import CandidatePairs, bounding_spheres
from robot_side.pairs.overlaps import NearestSurfaces, nearest_surfaces

CONTACT_PERIOD_S = 0.01
"""Contact is predicted this often: a controller is written to no more often."""
KEPT_S = 0.1
"""Contact that is predicted no more is kept for so long, lest a bump rattles at the horizon or at a grazed edge."""
_TOUCHING_M = 1e-4
_LEADING = 0.5
"""A sphere that touches already counts where the trigger leads into the surface, at most 60° off square: fingers
that slide along the target do not."""
_MOST_STEPS = 32

Contact = tuple[float | None, float | None]
"""The travel at contact, 0 to 1, of l2 and r2; None where there is none."""
_NONE: Contact = (None, None)


@dataclass(frozen=True)
class ContactSettings:
    """How far ahead contact is predicted."""

    reaction_s: float = 0.25
    """How long a person takes to act on what a finger feels (assumed); the loop age comes on top."""

    def __post_init__(self) -> None:
        if not 0.01 <= self.reaction_s <= 5.0:
            raise ValueError(f"reaction_s = {self.reaction_s}; valid: 0.01 to 5")


@dataclass(frozen=True)
class _Pairs:
    """Every sphere of the gripper with every primitive of one object."""

    objects: PerceivedObjects
    index: int
    spheres: int
    """How many spheres the gripper has."""
    sphere: IntArray
    """(p,) into the gripper's spheres; in `pairs` each pair has a point of its own"""
    pairs: CandidatePairs
    bound_centers_m: FloatArray
    """(b, 3) of spheres around its bounded primitives"""
    bound_radii_m: FloatArray
    """(b,)"""


class ContactPredictor:
    """Predicts contact with the target a hundred times a second, and keeps it in between."""

    def __init__(self, settings: ContactSettings, full_speed_m_s: float) -> None:
        """`full_speed_m_s`: v_max, at a trigger's full travel."""
        self.out_of_reach = 0
        """How often the target was too far off, by its bounding spheres, to be looked at."""
        self._settings = settings
        self._full_speed_m_s = full_speed_m_s
        self._contact = _NONE
        self._seen_s = [-math.inf, -math.inf]
        self._next_s = -math.inf
        self._pairs: _Pairs | None = None

    def predict(
        self, pose: GripperPose, objects: PerceivedObjects, target: int | None, loop_age_s: float, now_s: float
    ) -> Contact:
        """The contact at `now_s`, no older than CONTACT_PERIOD_S, or than KEPT_S where there is none any more.

        target: its index in `objects`; None for none, and while it is held. loop_age_s: t_d of eq. 8.
        """
        if target is None:
            self._contact, self._next_s = _NONE, -math.inf
        elif now_s >= self._next_s:
            self._next_s = now_s + CONTACT_PERIOD_S
            reach_m = self._full_speed_m_s * (loop_age_s + self._settings.reaction_s)
            distances_m = self._distances(pose, objects, target, reach_m)
            l2, r2 = (self._kept(trigger, distance / reach_m, now_s) for trigger, distance in enumerate(distances_m))
            self._contact = l2, r2
        return self._contact

    def _kept(self, trigger: int, travel: float, now_s: float) -> float | None:
        """`travel`, or for a while what it was before it went beyond 1."""
        if travel <= 1.0:
            self._seen_s[trigger] = now_s
            return travel
        return self._contact[trigger] if now_s - self._seen_s[trigger] <= KEPT_S else None

    def _distances(
        self, pose: GripperPose, objects: PerceivedObjects, target: int, reach_m: float
    ) -> tuple[float, float]:
        """How far the gripper gets by retreating and advancing before it touches the target; infinite beyond reach."""
        count = len(pose.sphere_radii_m)
        known = self._pairs
        if known is None or known.objects is not objects or known.index != target or known.spheres != count:
            known = self._pairs = _all_pairs(objects, target, count)
        offsets = known.bound_centers_m[:, None] - pose.sphere_centers_m
        far_m = known.bound_radii_m[:, None] + pose.sphere_radii_m + reach_m
        near = (np.einsum("bmi,bmi->bm", offsets, offsets) <= far_m * far_m).any()
        if not near and target not in objects.half_space_object:
            self.out_of_reach += 1
            return math.inf, math.inf
        points_m = pose.sphere_centers_m.take(known.sphere, axis=0)
        radii_m = pose.sphere_radii_m.take(known.sphere)
        nearest = nearest_surfaces(points_m, objects, known.pairs)
        approach = np.ascontiguousarray(pose.tool_rotation[:, 2])
        return (
            _swept_distance(known, points_m, radii_m, nearest, -approach, reach_m),
            _swept_distance(known, points_m, radii_m, nearest, approach, reach_m),
        )


def _swept_distance(
    known: _Pairs,
    points_m: FloatArray,
    radii_m: FloatArray,
    nearest: NearestSurfaces,
    direction: FloatArray,
    reach_m: float,
) -> float:
    """How far spheres at points_m (p, 3) get along the unit vector `direction` (3,); infinite beyond `reach_m`.

    nearest: seen from points_m, where the spheres stand.
    """
    points_m, moved_m = points_m.copy(), np.zeros(len(points_m))
    best_m: float = math.inf
    meshes = known.pairs.meshes
    for _ in range(_MOST_STEPS):
        best_m = _step(
            nearest.signed_distance_m,
            nearest.direction,
            radii_m,
            direction,
            meshes.start,
            meshes.stop,
            reach_m,
            moved_m,
            points_m,
            best_m,
        )
        if moved_m.max() < 0.0:
            return best_m
        nearest = nearest_surfaces(points_m, known.objects, known.pairs)
    # What still moves grazes the target: as far as it got, it does not touch.
    return min(best_m, float(moved_m[moved_m >= 0.0].min()))


@compiled(
    *(input_array(1), input_array(2), input_array(1), input_array(1)),
    *(COUNT, COUNT, NUMBER, output_array(1), output_array(2), NUMBER),
    returns=NUMBER,
)
def _step(
    distance: FloatArray,
    towards: FloatArray,
    radii: FloatArray,
    direction: FloatArray,
    first_mesh: int,
    end_mesh: int,
    reach: float,
    moved: FloatArray,
    points: FloatArray,
    best: float,
) -> float:
    """Move each sphere on by what it can surely go; one that touches, gets past or beyond `reach` has `moved` -1.

    The least that a sphere had moved when it touched, `best` if none did.
    """
    along = load(direction.reshape(1, 3), 0)
    for pair in range(distance.size):
        if moved[pair] < 0.0:
            continue
        gap = distance[pair] - radii[pair]
        closing = dot(load(towards, pair), along)
        if gap <= _TOUCHING_M:
            if moved[pair] > 0.0 or closing > _LEADING:
                best = min(best, moved[pair])
            moved[pair] = -1.0
            continue
        step = gap
        if not first_mesh <= pair < end_mesh:
            if closing <= 0.0:
                moved[pair] = -1.0
                continue
            step = gap / closing
        moved[pair] += step
        if moved[pair] >= min(best, reach):
            moved[pair] = -1.0
            continue
        for axis in range(3):
            points[pair, axis] += step * direction[axis]
    return best


def _all_pairs(objects: PerceivedObjects, index: int, count: int) -> _Pairs:
    """Each of `count` spheres with each primitive of the object `index`."""
    kinds = [
        np.flatnonzero(owner == index)
        for owner in (
            objects.sphere_object,
            objects.box_object,
            objects.tetrahedron_object,
            objects.mesh_object,
            objects.half_space_object,
        )
    ]
    ends = np.cumsum([len(rows) * count for rows in kinds]).tolist()
    spheres, boxes, tetrahedra, meshes, half_spaces = (
        slice(start, end) for start, end in zip([0, *ends], ends, strict=False)
    )
    primitive = np.repeat(np.concatenate(kinds), count)
    return _Pairs(
        objects,
        index,
        count,
        np.tile(np.arange(count), len(primitive) // count),
        CandidatePairs(
            np.arange(len(primitive)),
            primitive,
            np.full(len(primitive), index),
            spheres,
            boxes,
            tetrahedra,
            meshes,
            half_spaces,
            0,
        ),
        *bounding_spheres(objects, index),
    )
