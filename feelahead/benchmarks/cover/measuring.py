"""A gripper's cover against its true shape, by points of both surfaces."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.cover.field_cost import field_cost_us
from robot_side.arm.port import ArmState
from robot_side.gripper.solids import Solid
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_library import MeshLibrary, nearest_mesh_pairs
from robot_side.simulation.gripper_cover import cover_gripper, link_solids
from robot_side.simulation.gripper_measurement import open_gap
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import Scene, load_scene

_AT_A_TIME = 4096


@dataclass(frozen=True)
class Fit:
    """What was found for one gripper."""

    name: str
    geoms: int
    spheres: int
    sticks_out_mm: float
    """The greatest distance of a point of the geoms' surfaces from the nearest sphere; 0 where all are covered."""
    stands_out_mm: float
    """The greatest distance of a point of the spheres' outer surface from the nearest geom of the same link."""
    gap_mm: float | None
    """Between the two geoms that grip, open; None where nothing opens."""
    gap_kept_mm: float | None
    """Between their spheres."""
    made_s: float
    """Processor time"""
    field_us: float
    """Processor time of a look ahead at a wall, the least of many."""


def measure(
    name: str, model: Path | None, site: str | None, points: int, looks: int, seed: int, now_s: Callable[[], float]
) -> tuple[Fit, Scene]:
    """Cover the gripper of a model, and look at it; `now_s` tells the processor time."""
    scene = load_scene(model, site)
    geoms = scene.robot.gripper_geoms
    began_s = now_s()
    cover = cover_gripper(scene.model, geoms)
    made_s = now_s() - began_s
    random = np.random.default_rng(seed)
    sticks_out_m = stands_out_m = 0.0
    links = sorted(set(cover.bodies.tolist()))
    for link in links:
        own = cover.bodies == link
        solids = link_solids(scene.model, geoms[scene.model.geom_bodyid[geoms] == link].tolist())
        centers, radii = cover.centers_m[own], cover.radii_m[own]
        sticks_out_m = max(sticks_out_m, _sticks_out_m(solids, centers, radii, points // len(links), random))
        stands_out_m = max(stands_out_m, _stands_out_m(solids, centers, radii, points // len(links), random))
    gap = open_gap(scene, cover)
    robot, data = scene.robot, scene.data
    joints, fingers = data.qpos[robot.arm_positions], data.qpos[robot.finger_positions]
    pose = MujocoKinematics(scene).pose(ArmState(0.0, joints, np.zeros_like(joints), fingers, 0.0, False))
    return (
        Fit(
            name=name,
            geoms=len(geoms),
            spheres=len(cover.radii_m),
            sticks_out_mm=1e3 * sticks_out_m,
            stands_out_mm=1e3 * stands_out_m,
            gap_mm=None if gap is None else 1e3 * gap[0],
            gap_kept_mm=None if gap is None else 1e3 * gap[1],
            made_s=made_s,
            field_us=field_cost_us(pose, looks, now_s),
        ),
        scene,
    )


def _sticks_out_m(
    solids: Sequence[Solid], centers_m: FloatArray, radii_m: FloatArray, count: int, random: np.random.Generator
) -> float:
    """Of points all over the solids' surfaces and of their corners, but for those within another solid."""
    farthest_m = 0.0
    for number, solid in enumerate(solids):
        corners = solid.corners_m
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(across, axis=1)
        rows = random.choice(len(corners), count, p=areas / areas.sum())
        shares = random.dirichlet(np.ones(3), count)
        points = np.concatenate([np.einsum("nk,nki->ni", shares, corners[rows]), corners.reshape(-1, 3)])
        for other, its in enumerate(solids):
            if other != number:
                points = points[its.depth_m(points) <= 0.0]
        farthest_m = max([farthest_m, *(_from_spheres(piece, centers_m, radii_m).max() for piece in _pieces(points))])
    return float(farthest_m)


def _stands_out_m(
    solids: Sequence[Solid], centers_m: FloatArray, radii_m: FloatArray, count: int, random: np.random.Generator
) -> float:
    """Of points all over the spheres that are in no other sphere."""
    meshes = [
        Mesh(solid.corners_m.reshape(-1, 3), np.arange(3 * len(solid.corners_m)).reshape(-1, 3)) for solid in solids
    ]
    library = MeshLibrary(meshes)
    chances = radii_m**2 / (radii_m**2).sum()
    rows = random.choice(len(radii_m), count, p=chances)
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points = centers_m[rows] + radii_m[rows, None] * directions
    farthest_m = 0.0
    for piece in _pieces(points):
        outer = piece[_from_spheres(piece, centers_m, radii_m) >= -1e-9]
        distances = []
        for number, solid in enumerate(solids):
            index = np.full(len(outer), number, dtype=np.int64)
            turns = np.ascontiguousarray(np.broadcast_to(np.eye(3), (len(outer), 3, 3)))
            found, _ = nearest_mesh_pairs(np.ascontiguousarray(outer), library, index, np.zeros((len(outer), 3)), turns)
            # A round geom is up to so much smaller than the polyhedron that stands for it.
            distances.append(found + solid.excess_m)
        farthest_m = max(farthest_m, float(np.min(distances, axis=0).max(initial=0.0)))
    return farthest_m


def _from_spheres(points: FloatArray, centers_m: FloatArray, radii_m: FloatArray) -> FloatArray:
    nearest: FloatArray = (np.linalg.norm(points[:, None] - centers_m, axis=2) - radii_m).min(axis=1)
    return nearest


def _pieces(points: FloatArray) -> list[FloatArray]:
    return [points[first : first + _AT_A_TIME] for first in range(0, len(points), _AT_A_TIME)]
