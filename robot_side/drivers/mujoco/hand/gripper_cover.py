"""Cover of a simulated gripper: spheres that contain its colliding geoms, in the frames of its links."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray, IntArray
from robot_side.drivers.mujoco.mesh_arrays import mesh_vertices
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.gripper.capsule_cover import cover_capsule
from robot_side.gripper.kept_covers import SearchNotes, kept_cover
from robot_side.gripper.search_work import MOST_WORK, SearchWork
from robot_side.gripper.solids import Solid, capsule, convex_solid, cylinder, ellipsoid, simpler_convex_solid
from robot_side.gripper.spheres import cover_boxes
from robot_side.gripper.surface_cover import cover_surface

_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_WITH_ROWS = (GeomKind.SPHERE, GeomKind.CAPSULE, GeomKind.BOX)
"""Kinds of geoms whose cover is computed directly, with the fewest spheres; other kinds need a search."""
_SIMPLER = 0.05
"""Share of the largest protrusion by which a mesh's faces may be moved outwards, so that they are fewer"""

_Cover = tuple[FloatArray, FloatArray, float]
_Told = Callable[[float], None]


@dataclass(frozen=True)
class GripperCover:
    """Spheres that contain the surface of every geom, except parts within another geom of the same link."""

    centers_m: FloatArray
    """(m, 3) centres, each in the frame of the sphere's link"""
    radii_m: FloatArray
    """(m,) radii of the spheres"""
    bodies: IntArray
    """(m,) body of each sphere's link"""
    stand_out_m: float
    """Largest distance, in m, by which the spheres protrude from the geoms"""


@dataclass(frozen=True)
class _Part:
    """Geom in the frame of its link's first geom; hashable, so that links of the same shape share one cover."""

    kind: int
    size: tuple[float, ...]
    position_m: tuple[float, ...]
    quaternion: tuple[float, ...]
    points: bytes
    """Vertices (v, 3) of a mesh, or corners of another geom's bounding box"""


def cover_gripper(
    model: Any, geoms: IntArray, stand_out_m: float = 0.003, searching: SearchNotes | None = None
) -> GripperCover:
    """Cover the colliding geoms `geoms` (k,) of a compiled MuJoCo model.

    A mesh counts as its convex hull, which is the colliding shape. No sphere protrudes from the link's geoms by more
    than `stand_out_m`, unless a link would need more than 2000 spheres or too much work. Links of the same shape get
    the same spheres. searching: told of each search, but not of a stored cover. Two links are searched at a time, and
    each link's spheres are stored as soon as they are found.
    """
    # Sorted, as a set has no defined order.
    links = sorted(set(model.geom_bodyid[geoms].tolist()))
    frames, shapes = {}, {}
    for body in links:
        of_body = geoms[model.geom_bodyid[geoms] == body].tolist()
        # In the first geom's frame, which does not depend on the choice of the link's frame.
        first = Rotation.from_quat(model.geom_quat[of_body[0]], scalar_first=True)
        origin = model.geom_pos[of_body[0]]
        frames[body] = first, origin
        shapes[body] = tuple(_part(model, geom, first, origin) for geom in of_body)
    names = {parts: f"link {model.body(body).name!r} of the gripper" for body, parts in shapes.items()}
    # Of any links two threads then do at most half of all work each.
    limit = MOST_WORK / (sum(not _in_rows(parts) for parts in names) + 2)
    # NumPy and SciPy compute without the interpreter's lock, so threads run beside each other.
    with ThreadPoolExecutor(2) as threads:
        told = (None if searching is None else partial(searching.at, name) for name in names.values())
        covers = threads.map(lambda parts, tell: _cover_link(parts, stand_out_m, limit, tell), names, told)
        of_shape = dict(zip(names, covers, strict=True))
    centers, radii, bodies, stand_outs = [], [], [], []
    for body in links:
        found, found_radii, stand_out = of_shape[shapes[body]]
        first, origin = frames[body]
        centers.append(first.apply(found) + origin)
        radii.append(found_radii)
        bodies.append(np.full(len(found_radii), body, dtype=np.int64))
        stand_outs.append(stand_out)
    return GripperCover(np.concatenate(centers), np.concatenate(radii), np.concatenate(bodies), max(stand_outs))


def _part(model: Any, geom: int, first: Rotation, origin_m: FloatArray) -> _Part:
    kind = int(model.geom_type[geom])
    turn = first.inv() * Rotation.from_quat(model.geom_quat[geom], scalar_first=True)
    points = mesh_vertices(model, geom) if kind == GeomKind.MESH else _box_corners(model.geom_aabb[geom])
    return _Part(
        kind=kind,
        size=tuple(model.geom_size[geom].round(9).tolist()),
        position_m=tuple((first.inv().apply(model.geom_pos[geom] - origin_m).round(9) + 0.0).tolist()),
        quaternion=tuple((turn.as_quat(canonical=True).round(9) + 0.0).tolist()),
        points=points.astype(np.float64).tobytes(),
    )


def _box_corners(box: FloatArray) -> FloatArray:
    corners: FloatArray = box[:3] + _CORNERS * box[3:]
    return corners


def _cover_link(parts: tuple[_Part, ...], stand_out_m: float, limit: float, told: _Told | None) -> _Cover:
    if _in_rows(parts):
        return _rows(parts, stand_out_m)

    def search() -> _Cover:
        solids = [_solid(part, _SIMPLER * stand_out_m) for part in parts]
        placed = [solid.placed(*_pose(part)) for part, solid in zip(parts, solids, strict=True) if solid is not None]
        if len(placed) < len(parts):
            return _rows(parts, stand_out_m)
        frames = [_pose(part)[0] for part in parts]
        return cover_surface(placed, stand_out_m, frames, work=SearchWork(limit, told))

    return kept_cover(repr((parts, stand_out_m, limit)).encode(), search)


def _in_rows(parts: Sequence[_Part]) -> bool:
    return all(part.kind in _WITH_ROWS for part in parts)


def _pose(part: _Part) -> tuple[FloatArray, FloatArray]:
    return Rotation.from_quat(part.quaternion).as_matrix(), np.array(part.position_m)


def _rows(parts: Sequence[_Part], stand_out_m: float) -> _Cover:
    """Return the spheres of the parts one by one, a mesh's those of its bounding box; no search is needed."""
    centers, radii, stand_outs = [], [], []
    for part in parts:
        rotation, position = _pose(part)
        found, found_radii, stand_out = _with_rows(part, stand_out_m)
        centers.append(found @ rotation.T + position)
        radii.append(found_radii)
        stand_outs.append(stand_out)
    return np.concatenate(centers), np.concatenate(radii), max(stand_outs)


def _solid(part: _Part, simpler_by_m: float = 0.0) -> Solid | None:
    """Return the solid of a part, a mesh's with faces up to `simpler_by_m` outside; None if it encloses nothing."""
    match part.kind:
        case GeomKind.CYLINDER:
            return cylinder(part.size[0], part.size[1])
        case GeomKind.CAPSULE:
            return capsule(part.size[0], part.size[1])
        case GeomKind.SPHERE:
            return ellipsoid(np.full(3, part.size[0]))
        case GeomKind.ELLIPSOID:
            return ellipsoid(np.array(part.size))
        case _:
            points = _points(part)
            return simpler_convex_solid(points, simpler_by_m) if simpler_by_m > 0.0 else convex_solid(points)


def _points(part: _Part) -> FloatArray:
    return np.frombuffer(part.points).reshape(-1, 3)


def _with_rows(part: _Part, stand_out_m: float) -> tuple[FloatArray, FloatArray, float]:
    if part.kind in (GeomKind.SPHERE, GeomKind.CAPSULE):
        return cover_capsule(part.size[0], part.size[1] if part.kind == GeomKind.CAPSULE else 0.0, stand_out_m)
    lowest, highest = _points(part).min(axis=0), _points(part).max(axis=0)
    middle, half = 0.5 * (lowest + highest), 0.5 * (highest - lowest)
    cover = cover_boxes(middle[None], np.eye(3)[None], half[None], stand_out_m)
    return cover.centers_m, cover.radii_m, float(cover.stand_out_m.max())


def link_solids(model: Any, geoms: Sequence[int]) -> list[Solid]:
    """Return the true shapes of one link's geoms as polyhedra, in the link's frame, except those without volume."""
    identity, origin, solids = Rotation.identity(), np.zeros(3), []
    for geom in geoms:
        part = _part(model, geom, identity, origin)
        solid = _solid(part)
        if solid is not None:
            solids.append(solid.placed(Rotation.from_quat(part.quaternion).as_matrix(), np.array(part.position_m)))
    return solids


def placed_corners(model: Any, data: Any, geoms: IntArray) -> FloatArray:
    """Return the triangles (t, 3, 3) of the geoms' shapes, in the world frame, in the simulation's state `data`."""
    placed = []
    for geom in geoms.tolist():
        body = int(model.geom_bodyid[geom])
        placed += [
            solid.corners_m @ data.xmat[body].reshape(3, 3).T + data.xpos[body] for solid in link_solids(model, [geom])
        ]
    return np.concatenate([np.empty((0, 3, 3)), *placed])
