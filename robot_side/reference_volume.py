"""V_ref of §4.2 by calibration: the overlap that a plane gives which the gripper just touches."""

import numpy as np

from common.arrays import FloatArray

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
    enlarged_m = radii_m + np.maximum(enlargement_m, _LEAST_ENLARGEMENT_M)
    along = directions @ centers_m.T
    fronts = (along + radii_m).max(axis=1, keepdims=True)
    depth = np.clip(along + enlarged_m - fronts, 0.0, 2.0 * enlarged_m)
    caps: FloatArray = np.pi / 3.0 * depth**2 * (3.0 * enlarged_m - depth)
    total: FloatArray = caps.sum(axis=1)
    return total
