"""Grippers of a few spheres or of boxes, on a tool that moves freely, for tests of contact distances."""

from functools import cache

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.gripper.near_order import near_order
from robot_side.gripper.spheres import SphereCover, cover_boxes

# The built-in arm's gripper, open by 85 mm, in the tool frame: its fingers close along x. The palm, then each
# finger and its tip, which reach 15 mm beyond the point between the fingertips.
BOX_CENTERS_M = np.array(
    [
        [0.0, 0.0, -0.105],
        [0.0495, 0.0, -0.045],
        [0.0485, 0.0, -0.005],
        [-0.0495, 0.0, -0.045],
        [-0.0485, 0.0, -0.005],
    ]
)
BOX_HALF_SIZES_M = np.array(
    [
        [0.050, 0.032, 0.040],
        [0.007, 0.011, 0.020],
        [0.006, 0.011, 0.020],
        [0.007, 0.011, 0.020],
        [0.006, 0.011, 0.020],
    ]
)
OPENING_M = 0.085
FRONT_M = 0.018
"""Distance from the tool point to the front of the spheres: 15 mm of fingertip, and 3 mm by which spheres protrude."""


@cache
def cover_gripper(stand_out_m: float = 0.003) -> SphereCover:
    return cover_boxes(BOX_CENTERS_M, np.tile(np.eye(3), (len(BOX_CENTERS_M), 1, 1)), BOX_HALF_SIZES_M, stand_out_m)


def free_pose(
    centers_in_tool_m: npt.ArrayLike,
    radii_m: npt.ArrayLike,
    on_finger: npt.ArrayLike | None = None,
    tool_position_m: npt.ArrayLike = (0.0, 0.0, 0.0),
    tool_rotation: FloatArray | None = None,
) -> GripperPose:
    """Return a gripper of spheres, fixed to a tool that moves freely.

    The six joint velocities are the tool's linear and angular velocity in the world frame.
    """
    position = np.asarray(tool_position_m, dtype=np.float64)
    rotation = np.eye(3) if tool_rotation is None else tool_rotation
    radii = np.asarray(radii_m, dtype=np.float64)
    return GripperPose(
        tool_position_m=position,
        tool_rotation=rotation,
        tool_jacobian=np.eye(6),
        sphere_centers_m=position + np.asarray(centers_in_tool_m, dtype=np.float64).reshape(-1, 3) @ rotation.T,
        sphere_radii_m=radii,
        sphere_on_finger=np.zeros(len(radii), dtype=np.bool_)
        if on_finger is None
        else np.asarray(on_finger, dtype=np.bool_),
    )


def gripper_pose(
    tool_position_m: npt.ArrayLike = (0.0, 0.0, 0.0),
    tool_rotation: FloatArray | None = None,
    stand_out_m: float = 0.003,
) -> GripperPose:
    """Return the built-in gripper, covered by 246 spheres, or by fewer if `stand_out_m` is more than 3 mm."""
    cover = cover_gripper(stand_out_m)
    order = near_order(cover.centers_m, 6)
    return free_pose(cover.centers_m[order], cover.radii_m[order], cover.box[order] > 0, tool_position_m, tool_rotation)
