"""Measure how closely spheres cover a gripper, by points of both surfaces, and draw the gripper in its spheres."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.table import Row, Table
from feelahead.printing.pictures import figure
from robot_side.drivers.mujoco.gripper_measurement import open_gap
from robot_side.drivers.mujoco.hand.gripper_cover import cover_gripper, link_solids, placed_corners
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.gripper.solids import Solid
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_library import MeshLibrary, nearest_mesh_pairs

STANDS_OUT: Final = ("stands_out_median_mm", "stands_out_p99_mm", "stands_out_mm")
_AT_A_TIME: Final = 4096


@dataclass(frozen=True)
class Gripper:
    """One gripper, and how many points are sampled on the surface of its geoms, and as many on that of its spheres."""

    gripper: str
    model: Path | None
    """Model file; None: the built-in gripper."""
    site: str | None
    points: int


def measure_cover(cell: Gripper, seed: int) -> Iterator[Row]:
    """Cover the gripper with spheres, and yield a row for each of its links; distances are in mm."""
    scene = load_scene(cell.model, cell.site)
    geoms = scene.robot.gripper_geoms
    began_s = time.process_time()
    cover = cover_gripper(scene.model, geoms)
    whole: Row = {"made_s": time.process_time() - began_s}
    gap = open_gap(scene, cover)
    if gap is not None:
        whole |= {"gap_mm": 1e3 * gap[0], "gap_kept_mm": 1e3 * gap[1]}
    random = np.random.default_rng(seed)
    links = sorted(set(cover.bodies.tolist()))
    for link in links:
        own, of_link = cover.bodies == link, geoms[scene.model.geom_bodyid[geoms] == link].tolist()
        solids = link_solids(scene.model, of_link)
        spheres, count = (cover.centers_m[own], cover.radii_m[own]), cell.points // len(links)
        sticks_out_m = _sticks_out_m(solids, *spheres, count, random)
        stands_out_mm = 1e3 * _stand_out_m(solids, *spheres, count, random)
        row = {"part": scene.model.body(link).name or f"body {link}", "geoms": len(of_link), "spheres": int(own.sum())}
        yield row | {"sticks_out_mm": 1e3 * sticks_out_m} | _spread(stands_out_mm) | whole


def _spread(stands_out_mm: FloatArray) -> Row:
    found = np.quantile(stands_out_mm, (0.5, 0.99, 1.0)).tolist() if stands_out_mm.size else (0.0, 0.0, 0.0)
    return dict(zip(STANDS_OUT, found, strict=True))


def _sticks_out_m(
    solids: Sequence[Solid], centers_m: FloatArray, radii_m: FloatArray, count: int, random: np.random.Generator
) -> float:
    """Return the largest distance of the solids' surface from the spheres, where it is outside of all spheres.

    Points and corners of a solid's surface are sampled, except those within another solid. 0: the cover is complete.
    """
    farthest_m = 0.0
    for number, solid in enumerate(solids):
        corners = solid.corners_m
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        rows = random.choice(len(corners), count, p=areas / areas.sum())
        shares = random.dirichlet(np.ones(3), count)
        points = np.concatenate([np.einsum("nk,nki->ni", shares, corners[rows]), corners.reshape(-1, 3)])
        for other, its in enumerate(solids):
            if other != number:
                points = points[its.depth_m(points) <= 0.0]
        farthest_m = max([farthest_m, *(_from_spheres(piece, centers_m, radii_m).max() for piece in _pieces(points))])
    return float(farthest_m)


def _stand_out_m(
    solids: Sequence[Solid], centers_m: FloatArray, radii_m: FloatArray, count: int, random: np.random.Generator
) -> FloatArray:
    """Return how far sampled points of the spheres' outer surface are from the nearest solid, in metres."""
    library = MeshLibrary(
        [Mesh(one.corners_m.reshape(-1, 3), np.arange(3 * len(one.corners_m)).reshape(-1, 3)) for one in solids]
    )
    rows = random.choice(len(radii_m), count, p=radii_m**2 / (radii_m**2).sum())
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    distances_m = []
    for piece in _pieces(centers_m[rows] + radii_m[rows, None] * directions):
        outer = np.ascontiguousarray(piece[_from_spheres(piece, centers_m, radii_m) >= -1e-9])
        turns = np.ascontiguousarray(np.broadcast_to(np.eye(3), (len(outer), 3, 3)))
        still = np.zeros((len(outer), 3))
        # A round geom lies up to `excess_m` within the polyhedron that stands for it.
        from_each = [
            nearest_mesh_pairs(outer, library, np.full(len(outer), number), still, turns)[0] + solid.excess_m
            for number, solid in enumerate(solids)
        ]
        distances_m.append(np.min(from_each, axis=0))
    return np.concatenate(distances_m) if distances_m else np.empty(0)


def _from_spheres(points: FloatArray, centers_m: FloatArray, radii_m: FloatArray) -> FloatArray:
    nearest: FloatArray = (np.linalg.norm(points[:, None] - centers_m, axis=2) - radii_m).min(axis=1)
    return nearest


def _pieces(points: FloatArray) -> list[FloatArray]:
    return [points[first : first + _AT_A_TIME] for first in range(0, len(points), _AT_A_TIME)]


def draw_cover(table: Table, path: Path) -> None:
    """Draw each gripper's geoms in black on its spheres, from the front and from the side; the approach points up."""
    from matplotlib.collections import EllipseCollection, PolyCollection  # noqa: PLC0415  # slow to load

    grippers = list(table.groups("gripper", "model", "site"))
    with figure(path, 2, len(grippers), figsize=(3.2 * len(grippers), 6.4), squeeze=False) as (_, axes):
        for column, ((name, model, site), _rows) in enumerate(grippers):
            scene = load_scene(None if model is None else Path(model), site)
            gripper = PosedGripper(scene)
            pose = gripper.at(gripper.home_rad)
            centers = 1e3 * (pose.sphere_centers_m - pose.tool_position_m) @ pose.tool_rotation
            corners = placed_corners(scene.model, scene.data, scene.robot.gripper_geoms) - pose.tool_position_m
            corners, sizes = 1e3 * corners @ pose.tool_rotation, 2e3 * pose.sphere_radii_m
            for across, seen in enumerate(axes[:, column]):
                spheres = EllipseCollection(
                    sizes, sizes, np.zeros_like(sizes), units="xy", offsets=centers[:, [across, 2]],
                    offset_transform=seen.transData,
                    facecolor=(0.3, 0.55, 0.85, 0.25), edgecolor=(0.1, 0.3, 0.6, 0.5), linewidth=0.4,
                )  # fmt: skip
                seen.add_collection(spheres)
                seen.add_collection(PolyCollection(list(corners[:, :, [across, 2]]), facecolor=(0.0, 0.0, 0.0, 0.25)))
                seen.set(aspect="equal", xlabel=f"{'xy'[across]} of the tool, mm")
                seen.autoscale_view()
            axes[0, column].set_title(f"{name}: {len(sizes)} spheres", fontsize=9)
        axes[0, 0].set_ylabel("along the approach, mm")
