"""An object between the fingers moves with them: it leaves the surroundings and joins the gripper as spheres."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.distances import distance_to_object
from robot_side.arm.port import GripperPose
from robot_side.gripper.held_covers import HeldCovers
from robot_side.objects.perceived import PerceivedObjects, Role


@dataclass(frozen=True)
class HeldObject:
    """The spheres that cover it, as they stood in the tool frame when it was gripped."""

    index: int
    """Its place among the perceived objects' names."""
    name: str
    centers_in_tool_m: FloatArray
    """(k, 3)"""
    radii_m: FloatArray
    """(k,)"""


def gripped_object(objects: PerceivedObjects, tool_position_m: FloatArray, reach_m: float) -> int | None:
    """The object nearest to the point between the fingertips, within `reach_m`; None when there is none.

    Supports are never held: an arm that closes its fingers on the table does not lift it. Nor is anything with a
    half-space, which has no end to be lifted by, whatever its role.
    """
    unbounded = set(objects.half_space_object.tolist())
    distances = {
        index: distance_to_object(objects, index, tool_position_m)
        for index, role in enumerate(objects.roles)
        if role is not Role.SUPPORT and index not in unbounded
    }
    nearest = min(distances, key=lambda index: distances[index], default=None)
    return nearest if nearest is not None and distances[nearest] <= reach_m else None


def grip(objects: PerceivedObjects, index: int, pose: GripperPose, covers: HeldCovers | None = None) -> HeldObject:
    """The object `index`, fixed to the tool from now on.

    `covers`: made from an earlier frame of the same objects; without them they are made now, which takes longer than
    a tick.
    """
    in_world, radii = (HeldCovers(objects) if covers is None else covers).spheres(objects, index)
    return HeldObject(
        index=index,
        name=objects.names[index],
        centers_in_tool_m=(in_world - pose.tool_position_m) @ pose.tool_rotation,
        radii_m=radii,
    )


def with_held(pose: GripperPose, held: HeldObject) -> GripperPose:
    """The gripper's spheres and after them the held object's, all moving with the tool."""
    lever = held.centers_in_tool_m @ pose.tool_rotation.T
    return GripperPose(
        tool_position_m=pose.tool_position_m,
        tool_rotation=pose.tool_rotation,
        tool_jacobian=pose.tool_jacobian,
        sphere_centers_m=np.concatenate([pose.sphere_centers_m, pose.tool_position_m + lever]),
        sphere_radii_m=np.concatenate([pose.sphere_radii_m, held.radii_m]),
        sphere_on_finger=np.concatenate([pose.sphere_on_finger, np.zeros(len(lever), dtype=np.bool_)]),
    )
