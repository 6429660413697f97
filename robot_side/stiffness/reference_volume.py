"""V_ref of §4.2 by calibration: the overlap that a plane gives which the gripper just touches."""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import compiled, input_array, output_array
from robot_side.compiled.vectors import dot, load

_LEAST_ENLARGEMENT_M = 1e-3
"""A gripper that is hardly enlarged would make the step from nothing to s = 1 within micrometres."""


def plane_overlaps(
    centers_m: FloatArray, radii_m: FloatArray, enlargement_m: FloatArray, directions: FloatArray
) -> FloatArray:
    """Reference volumes (k,) in m³, one for each unit direction (k, 3) in which the gripper may move.

    The plane is square to the direction and touches the foremost of the spheres centers_m (m, 3), radii_m (m,)
    before they are enlarged by enlargement_m, (m,) or (k, m) if it depends on the direction; its overlap with the
    enlarged ones is the sum of the caps π d² (3R - d) / 3, d being how deep each lies behind it.

    So a plane at the gripper's surface gives s = 1 at every delay: with a fixed share of the enlarged gripper's
    volume it would give a stiffness that grows from 0.05 to 0.69 as the enlargement grows from 7 to 60 mm
    (docs/architecture.md).
    """
    volumes = np.empty(len(directions))
    _plane_loop(
        np.ascontiguousarray(centers_m),
        np.ascontiguousarray(radii_m),
        np.ascontiguousarray(enlargement_m).reshape(-1, len(radii_m)),
        np.ascontiguousarray(directions),
        volumes,
    )
    return volumes


@compiled(input_array(2), input_array(1), input_array(2), input_array(2), output_array(1))
def _plane_loop(
    centers: FloatArray, radii: FloatArray, enlargement: FloatArray, directions: FloatArray, volumes: FloatArray
) -> None:
    for k in range(volumes.size):
        direction = load(directions, k)
        row = k if enlargement.shape[0] > 1 else 0
        front = -math.inf
        for sphere in range(radii.size):
            front = max(front, dot(direction, load(centers, sphere)) + radii[sphere])
        volumes[k] = 0.0
        for sphere in range(radii.size):
            enlarged = radii[sphere] + max(enlargement[row, sphere], _LEAST_ENLARGEMENT_M)
            reached = dot(direction, load(centers, sphere)) + enlarged
            depth = min(max(reached - front, 0.0), 2.0 * enlarged)
            volumes[k] += math.pi / 3.0 * depth * depth * (3.0 * enlarged - depth)
