"""The target between the fingers is where it should be: what overlaps there is no danger (§3.4, roles)."""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.arm.port import GripperPose
from robot_side.compiled.kernel import NUMBER, compiled, input_array, input_indices, output_array
from robot_side.compiled.vectors import dot, load, negative, scale, subtract, unit
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.pairs.candidates import CandidatePairs
from robot_side.pairs.nearest_object import distance_to_object
from robot_side.pairs.overlaps import NearestSurfaces

_BESIDE = 0.5
_BETWEEN = 0.85
"""Cosines between a finger's inward direction and the way to the target: 60° off is beside, 32° between."""
_ENTERED_M = 0.015
"""While the point between the fingertips is this near to the target or nearer, the target is entering the gap."""


def outside_share(
    pose: GripperPose, objects: PerceivedObjects, pairs: CandidatePairs, nearest: NearestSurfaces
) -> FloatArray | None:
    """How much of each candidate pair's overlap counts: (p,) 1 but for fingers that have the target on their inside.

    There it falls smoothly to 0, as the target's nearest point comes to lie straight across the gap from the
    finger, or as the target reaches the point between the fingertips: from then on what lies ahead of the palm
    counts. None while no pair is of a finger and the target, which is 1 for all.
    """
    on_finger = pose.sphere_on_finger.take(pairs.sphere_index).tolist()
    rows = [
        row
        for row, (finger, index) in enumerate(zip(on_finger, pairs.object_index.tolist(), strict=True))
        if finger and objects.roles[index] is Role.TARGET
    ]
    if not rows:
        return None
    targets = [index for index, role in enumerate(objects.roles) if role is Role.TARGET]
    gap_m = min(distance_to_object(objects, index, pose.tool_position_m) for index in targets)
    share = np.ones(len(pairs))
    _share_loop(
        np.array(rows),
        pose.sphere_centers_m.take(pairs.sphere_index.take(rows), axis=0) - pose.tool_position_m,
        np.ascontiguousarray(pose.tool_rotation),
        nearest.direction,
        min(1.0, max(0.0, gap_m / _ENTERED_M)),
        share,
    )
    return share


@compiled(input_indices(), input_array(2), input_array(2), input_array(2), NUMBER, output_array(1))
def _share_loop(
    rows: IntArray,
    offsets: FloatArray,
    tool_rotation: FloatArray,
    directions: FloatArray,
    entering: float,
    share: FloatArray,
) -> None:
    """Write the share of each of `rows`, whose spheres stand at `offsets` from the tool.

    `entering`: 0 when the target is between the fingertips, 1 when it is clear of them.
    """
    approach = load(tool_rotation.T, 2)
    for k in range(rows.size):
        offset = load(offsets, k)
        inward = negative(unit(subtract(offset, scale(dot(offset, approach), approach))))
        cosine = dot(inward, load(directions, rows[k]))
        x = min(max((cosine - _BESIDE) / (_BETWEEN - _BESIDE), 0.0), 1.0)
        share[rows[k]] = (1.0 - x * x * (3.0 - 2.0 * x)) * entering
