"""Places of a scene's objects before the gripper, and the distances that the true gripper can go there."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.errors import FeelaheadError
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.reference.pairs import BOX_SIGNS
from robot_side.arm.port import GripperPose
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.gripper.solids import convex_solid, ellipsoid
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_library import MeshLibrary
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, scene_table

REACH_M: Final = 0.4
"""Distance that every method examines"""
_FREE_M: Final = (0.02, 0.15)
_ASIDE_M: Final = 0.08
_BESIDE_M: Final = 0.012
_TRIES: Final = 200
_FARTHEST_M: Final = 2.0


@dataclass(frozen=True, eq=False)
class Placement:
    """Objects of a scene, moved to one place before the gripper, which stays in its home pose."""

    scene: Scene
    pose: GripperPose
    """Gripper, with the spheres that are built in"""
    shift_m: FloatArray
    """(3,) displacement of all objects from their frozen places"""

    @property
    def axis(self) -> FloatArray:
        """Approach axis û (3,)"""
        axis: FloatArray = np.ascontiguousarray(self.pose.tool_rotation[:, 2])
        return axis

    @cached_property
    def posed(self) -> PosedScene:
        """True gripper among the true objects"""
        return self.seen_after(np.zeros(3))

    def seen_after(self, moved_m: FloatArray) -> PosedScene:
        """Return the scene after the gripper has moved by `moved_m` (3,), as seen from it: the objects come nearer."""
        scene = self.scene
        posed, robot = PosedScene(scene), scene.robot
        posed.set_pose(
            scene.data.qpos[robot.arm_positions], scene.data.qpos[robot.finger_positions], self.shift_m - moved_m
        )
        return posed

    @cached_property
    def true_m(self) -> float:
        """Distance that the true gripper can go along û, by MuJoCo, to 0.01 mm"""
        return self.posed.contact_distance_m(_FARTHEST_M)

    @cached_property
    def seen(self) -> PerceivedObjects:
        """Objects without errors"""
        return self.posed.perceived(np.zeros((len(self.scene.objects), 3)))

    @cached_property
    def table(self) -> SceneTable:
        """Objects as a look takes them"""
        return scene_table(self.seen)


def placements(name: str, count: int, random: np.random.Generator) -> list[Placement]:
    """Draw places of a frozen scene's objects, 20 to 150 mm ahead of the gripper and up to 80 mm aside.

    Left out are places where 12 mm aside change the distance by more than 12 mm: any distance may be right there.
    FeelaheadError if no place is left.
    """
    scene = load_scene(frozen_scene(name), SITE)
    gripper = PosedGripper(scene)
    pose = gripper.at(gripper.home_rad)
    right, up, ahead = pose.tool_rotation.T
    turns = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    found, ways = list[Placement](), np.outer(np.cos(turns), right) + np.outer(np.sin(turns), up)
    for _ in range(_TRIES):
        aside_m = random.uniform(-_ASIDE_M, _ASIDE_M, 2) @ np.array([right, up])
        there = Placement(scene, pose, aside_m)
        if there.true_m >= _FARTHEST_M:
            continue
        there = Placement(scene, pose, aside_m + (random.uniform(*_FREE_M) - there.true_m) * ahead)
        beside = (there.seen_after(_BESIDE_M * way).contact_distance_m(_FARTHEST_M) for way in ways)
        if there.true_m > 0.5 * _FREE_M[0] and all(abs(one - there.true_m) <= _BESIDE_M for one in beside):
            found.append(there)
        if len(found) == count:
            break
    if not found:
        raise FeelaheadError(
            f"scene {name}: none of {_TRIES} drawn places is usable; valid: a scene with a thing ahead"
        )
    return found


def as_meshes(seen: PerceivedObjects, *, balls: bool = True) -> PerceivedObjects:
    """Return the same objects as meshes: boxes exactly, and balls, if asked, as polyhedra around them.

    Tetrahedra stay, and objects with meshes are returned as they are.
    """
    boxes = seen.box_centers_m, seen.box_rotations, seen.box_half_sizes_m, seen.box_object
    placed = [
        (convex_solid(BOX_SIGNS * half), middle, turn, owner) for middle, turn, half, owner in zip(*boxes, strict=True)
    ]
    emptied = ["box_centers_m", "box_rotations", "box_half_sizes_m", "box_object"]
    if balls:
        own = seen.sphere_centers_m, seen.sphere_radii_m, seen.sphere_object
        placed += [
            (ellipsoid(np.full(3, radius)), middle, np.eye(3), owner)
            for middle, radius, owner in zip(*own, strict=True)
        ]
        emptied += ["sphere_centers_m", "sphere_radii_m", "sphere_object"]
    if seen.mesh_library is not None or not placed:
        return seen
    solids, middles, turns, owners = zip(*placed, strict=True)
    corners = [solid.corners_m.reshape(-1, 3) for solid in solids if solid is not None]
    return replace(
        seen,
        **{name: getattr(seen, name)[:0] for name in emptied},
        mesh_library=MeshLibrary([Mesh(one, np.arange(len(one)).reshape(-1, 3)) for one in corners]),
        mesh_index=np.arange(len(placed)),
        mesh_positions_m=np.array(middles),
        mesh_rotations=np.array(turns),
        mesh_object=np.array(owners),
    )
