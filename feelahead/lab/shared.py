"""Measure how exact the volume is that the built-in gripper shares with a thing, against voxels, and what it costs."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import BoolArray, FloatArray
from common.roles import Role
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.reference.voxels import voxel_volume_m3
from feelahead.lab.table import Row
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.drivers.remote.frame_build import perceived
from robot_side.drivers.remote.frame_message import SeenObject
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.shared_volume import shared_volume_m3
from robot_side.field.total_overlap import total_overlap_m3
from robot_side.surroundings.scene_table import scene_table

THINGS: Final = ("box", "tetrahedra", "ellipsoid", "sphere", "half_space")
FIGURES: Final = ("volume_mm3", "off_mm3", "off_share", "counted_times", "shared_us", "total_us", "look_us")
_INFLATED_MM: Final = (0.0, 7.0, 14.0, 27.0)
_CORNERS: Final = np.array(list(product((-1.0, 1.0), repeat=3)))
_FACES: Final = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_REPEATED: Final = 20
_REACH_M: Final = 0.2


@dataclass(frozen=True)
class Shared:
    """Pose of a thing at random within the gripper, and the voxels that are counted."""

    thing: str
    inflated_mm: float
    step_mm: float


def shared_cells(*, quick: bool) -> Iterator[Shared]:
    """Yield the 20 poses, or few with large voxels."""
    for thing, inflated_mm in product(THINGS, _INFLATED_MM):
        if not quick or inflated_mm == _INFLATED_MM[1]:
            yield Shared(thing, inflated_mm, 1.0 if quick else 0.2)


def measure_shared(cell: Shared, seed: int) -> Iterator[Row]:
    """Yield the volume, how far off it is, how many times Σ V_ij counts it, and processor times in µs."""
    random = np.random.default_rng([seed, THINGS.index(cell.thing), round(cell.inflated_mm)])
    scene = load_scene()
    gripper = PosedGripper(scene)
    pose = gripper.at(gripper.home_rad)
    turned = Rotation.random(random_state=random)
    middle_m = pose.sphere_centers_m.mean(axis=0) + random.uniform(-0.05, 0.05, 3)
    sizes_m = random.uniform(0.01, 0.08, 3)
    spheres = np.column_stack([pose.sphere_centers_m, pose.sphere_radii_m + 1e-3 * cell.inflated_mm])
    seen, inside = _thing(cell.thing, sizes_m)
    x, y, z, w = turned.as_quat().tolist()
    here = SeenObject(name="thing", position_m=tuple(middle_m.tolist()), quaternion=(w, x, y, z), **seen)
    table, classes = scene_table(perceived([here], [Role.OBSTACLE], 0.0)), np.zeros(1, dtype=np.int64)
    found_m3 = shared_volume_m3(spheres, table, classes)
    matrix = turned.as_matrix()
    counted_m3 = voxel_volume_m3(spheres, lambda points: inside((points - middle_m) @ matrix), 1e-3 * cell.step_mm)
    along = Along(pose.tool_rotation[:, 2].copy(), 1e-3 * cell.inflated_mm, 0.0, 0.0, _REACH_M, 0.0, 0.0)
    ahead = Ahead(np.zeros(len(gripper.home_rad)))
    yield {
        "volume_mm3": 1e9 * counted_m3,
        "off_mm3": 1e9 * (found_m3 - counted_m3),
        "off_share": found_m3 / counted_m3 - 1.0,
        "counted_times": total_overlap_m3(spheres, table, classes) / counted_m3,
        "shared_us": _took_us(lambda: shared_volume_m3(spheres, table, classes)),
        "total_us": _took_us(lambda: total_overlap_m3(spheres, table, classes)),
        "look_us": _took_us(lambda: ahead.look(pose, table, classes, along)),
    }


def _thing(name: str, sizes_m: FloatArray) -> tuple[dict[str, Any], Callable[[FloatArray], BoolArray]]:
    """Return a shape's fields, and whether points (n, 3) of its own frame are inside."""
    half, radius = tuple(sizes_m.tolist()), float(sizes_m[0])
    if name == "half_space":
        return {"half_space": True}, lambda points: points[:, 2] <= 0.0
    if name in ("sphere", "ellipsoid"):
        axes = np.full(3, radius) if name == "sphere" else sizes_m
        shape = {"sphere": radius} if name == "sphere" else {"ellipsoid": half}
        return shape, lambda points: ((points / axes) ** 2).sum(axis=1) <= 1.0
    # A box, whole or as twelve tetrahedra: two on each face, with the middle as their fourth corner.
    corners = [tuple(corner) for corner in (_CORNERS * sizes_m).tolist()]
    halves = [(corners[a], corners[b], corners[c]) for i, j, k, m in _FACES for a, b, c in ((i, j, k), (i, k, m))]
    tetrahedra = tuple(((0.0, 0.0, 0.0), *triangle) for triangle in halves)
    shape = {"box": half} if name == "box" else {"tetrahedra": tetrahedra}
    return shape, lambda points: (np.abs(points) <= sizes_m).all(axis=1)


def _took_us(call: Callable[[], object]) -> float:
    """Return the median processor time of a call, in µs, after a first one."""
    call()
    took_s = []
    for _ in range(_REPEATED):
        began_s = time.thread_time()
        call()
        took_s.append(time.thread_time() - began_s)
    return 1e6 * float(np.median(took_s))
