"""Held object: it is removed from the surroundings, and its spheres move with the gripper."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from common.arrays import BoolArray, FloatArray
from common.roles import Role
from robot_side.arm.port import GripperPose
from robot_side.gripper.held_covers import HeldCovers
from robot_side.surroundings.distances import object_distances
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable


@dataclass(frozen=True)
class HeldObject:
    """Object and its spheres, which are fixed in the tool frame since the grip."""

    index: int
    """Index of the object among the perceived objects."""
    name: str
    centers_in_tool_m: FloatArray
    """(k, 3) centres of the object's spheres in the tool frame, contiguous"""
    radii_m: FloatArray
    """(m + k,) radii of the gripper's spheres, then of the object's"""
    on_finger: BoolArray
    """(m + k,) whether each sphere belongs to a finger"""

    @cached_property
    def spheres_in_tool(self) -> FloatArray:
        """(k, 4) the object's spheres in the tool frame: centres and radii"""
        return np.column_stack([self.centers_in_tool_m, self.radii_m[-len(self.centers_in_tool_m) :]])


def gripped_object(scene: SceneTable, tool_position_m: FloatArray, reach_m: float) -> int | None:
    """Return the index of the object nearest to the point between the fingertips, within `reach_m`; None without one.

    Supports are never held: an arm that closes its fingers on the table does not lift the table. Nor is an object with
    a half-space, whatever its role, because it is unbounded.
    """
    objects = scene.objects
    unbounded = set(objects.half_space_object.tolist())
    point_m, no_radius = np.ascontiguousarray(tool_position_m[None]), np.zeros(1)
    distances_m = object_distances(point_m, no_radius, scene, reach_m)
    within = (
        index
        for index in np.flatnonzero(np.isfinite(distances_m)).tolist()
        if objects.roles[index] is not Role.SUPPORT and index not in unbounded
    )
    return min(within, key=lambda index: float(distances_m[index]), default=None)


def grip(objects: PerceivedObjects, index: int, pose: GripperPose, covers: HeldCovers | None = None) -> HeldObject:
    """Return the object `index` as held, fixed to the tool from now on.

    covers: made from an earlier frame of the same objects; None: made now, which takes longer than a tick.
    """
    in_world, radii = (HeldCovers(objects) if covers is None else covers).spheres(objects, index)
    return HeldObject(
        index=index,
        name=objects.names[index],
        centers_in_tool_m=(in_world - pose.tool_position_m) @ pose.tool_rotation,
        radii_m=np.concatenate([pose.sphere_radii_m, radii]),
        on_finger=np.concatenate([pose.sphere_on_finger, np.zeros(len(radii), dtype=np.bool_)]),
    )


def with_held(pose: GripperPose, held: HeldObject) -> GripperPose:
    """Return the pose with the spheres of the gripper and of the held object, which moves with the tool."""
    held_m = pose.tool_position_m + held.centers_in_tool_m @ pose.tool_rotation.T
    centers_m = np.concatenate([pose.sphere_centers_m, held_m])
    spheres = centers_m, held.radii_m, held.on_finger
    return GripperPose(pose.tool_position_m, pose.tool_rotation, pose.tool_jacobian, *spheres)
