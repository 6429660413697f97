"""The ways of one look in plain NumPy and public functions (§4.2), which the compiled pass is held against.

Nothing is passed over for speed but what could shorten no way, and nothing of the compiled pass is used but constants.
Meshes are not looked at.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from feelahead.lab.reference.meshes import CUBE_CORNERS, CUBE_TRIANGLES, TETRAHEDRON_TRIANGLES
from feelahead.lab.reference.plain_ramp import Ramp
from robot_side.ahead.field import LEAST_DEPTH_M, MARGIN_M, Along
from robot_side.ahead.find import PASSED_OVER, TARGET, TOUCHABLE
from robot_side.ahead.kinds.layout import CLOSING, LEAST_WAY_M, MOST_STEPS, TOUCHING_M
from robot_side.ahead.tables import STRENGTHS, TOUCH_STRENGTH
from robot_side.arm.port import GripperPose
from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap import Mesh, MeshLibrary, sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron
from robot_side.overlap.meshes.mesh_library import mesh_pairs, nearest_mesh_pairs

Nearest = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From points (m, 3) to distances (m,), negative or 0 inside, and unit directions (m, 3) in which they fall."""
Overlaps = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""From spheres at (k, 3) with radii (k,) to V (k,) and the gradients (k, 3)."""


Ways = Callable[[FloatArray, FloatArray, FloatArray, float], FloatArray]
"""From spheres, centers (m, 3), radii (m,), a direction (3,) and a reach to the ways (m,) to a touch."""


@dataclass(frozen=True)
class Primitive:
    """One primitive of an object."""

    thing: int
    volume_m3: float
    overlap: Overlaps
    ways: Ways | None
    """None of a mesh, which plain ways are not looked to."""


def primitives(objects: PerceivedObjects) -> list[Primitive]:
    """Take all of a frame, kind by kind."""
    seen = objects
    kinds: tuple[tuple[IntArray, tuple[FloatArray | IntArray, ...], Callable[..., Primitive]], ...] = (
        (seen.sphere_object, (seen.sphere_centers_m, seen.sphere_radii_m), _sphere),
        (seen.box_object, (seen.box_centers_m, seen.box_rotations, seen.box_half_sizes_m), _box),
        (seen.tetrahedron_object, (seen.tetrahedron_vertices_m,), _tetrahedron),
        (seen.half_space_object, (seen.half_space_normals, seen.half_space_offsets_m), _half_space),
        (
            seen.mesh_object,
            (seen.mesh_index, seen.mesh_positions_m, seen.mesh_rotations),
            partial(_mesh, seen.mesh_library),
        ),
    )
    return [
        make(int(thing), *shape)
        for things, columns, make in kinds
        for thing, *shape in zip(things, *columns, strict=True)
    ]


def _sphere(thing: int, center: FloatArray, radius: float) -> Primitive:
    overlap = _overlap(sphere_sphere, center, np.asarray(radius))
    return Primitive(thing, 4.0 / 3.0 * np.pi * float(radius) ** 3, overlap, _ways_to_sphere(center, radius))


def _box(thing: int, *box: FloatArray) -> Primitive:
    center, rotation, half_sizes = box
    nearest = _nearest_on(center + CUBE_CORNERS * half_sizes @ rotation.T, CUBE_TRIANGLES)
    return Primitive(thing, 8.0 * float(np.prod(half_sizes)), _overlap(sphere_box, *box), _advance(nearest))


def _tetrahedron(thing: int, vertices: FloatArray) -> Primitive:
    volume = abs(float(np.linalg.det(vertices[1:] - vertices[0]))) / 6.0
    nearest = _nearest_on(vertices, TETRAHEDRON_TRIANGLES)
    return Primitive(thing, volume, _overlap(sphere_tetrahedron, vertices), _advance(nearest))


def _half_space(thing: int, normal: FloatArray, offset: float) -> Primitive:
    overlap = _overlap(sphere_half_space, normal, np.asarray(offset))
    return Primitive(thing, np.inf, overlap, _ways_to_half_space(normal, offset))


def _mesh(library: MeshLibrary | None, thing: int, index: int, position: FloatArray, rotation: FloatArray) -> Primitive:
    if library is None:
        raise ValueError("mesh_library = None; valid: the library of the meshes")

    def overlap(centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        places = (np.repeat(np.asarray(one)[None], len(radii), axis=0) for one in (index, position, rotation))
        volumes, gradients, _ = mesh_pairs(centers, radii, library, *places)
        return volumes, gradients

    return Primitive(thing, float(library.tables.volumes[index]), overlap, None)


def statistical_m(pose: GripperPose, along: Along, encoder_sigma_rad: FloatArray) -> tuple[FloatArray, float]:
    """Return D_σ of each sphere (m,) along û, and where it is expected (P = 0.5): eq. 5, 9 and 10."""
    leaning = np.einsum("a,man->mn", along.direction, pose.sphere_jacobians)
    spread = np.sqrt(leaning**2 @ encoder_sigma_rad**2 + along.variance_m2)
    sigma_m: FloatArray = np.maximum(0.0, along.mean_m + along.quantile * spread)
    return sigma_m, max(0.0, along.mean_m)


def plain_ways(
    pose: GripperPose,
    objects: PerceivedObjects,
    standing: IntArray,
    along: Along,
    widest_m: float,
    encoder_sigma_rad: FloatArray,
) -> FloatArray:
    """Find the ways (2, 8), fast and slow, as `Ahead.look` has them; the arguments are its own.

    ValueError where there are meshes.
    """
    if len(objects.mesh_object):
        raise ValueError(f"{len(objects.mesh_object)} meshes; valid: spheres, boxes, tetrahedra and half-spaces")
    sigma_m, expected_m = statistical_m(pose, along, encoder_sigma_rad)
    ways_m: FloatArray = np.full((2, STRENGTHS), np.inf)
    ramps = []
    by_object: dict[int, list[Primitive]] = {}
    for one in primitives(objects):
        by_object.setdefault(one.thing, []).append(one)
    for thing, parts in by_object.items():
        if standing[thing] == PASSED_OVER:
            continue
        early_m = 0.0 if along.early_m is None else float(along.early_m[thing])
        inflated_m = sigma_m
        if standing[thing] == TARGET:
            inflated_m = np.where(pose.sphere_on_finger, np.minimum(sigma_m, widest_m), sigma_m)
        touchable = bool(standing[thing] in (TOUCHABLE, TARGET))
        swollen: BoolArray = np.ones(len(sigma_m), dtype=np.bool_)
        for bare in (False, True):
            radii = pose.sphere_radii_m + (0.0 if bare else inflated_m)
            reach_m = along.reach_m + MARGIN_M + early_m
            found = [part.ways for part in parts if part.ways is not None]
            entries = np.array([ways(pose.sphere_centers_m, radii, along.direction, reach_m) for ways in found])
            for i in np.flatnonzero((entries <= reach_m).any(axis=0) & swollen):
                met = np.flatnonzero(entries[:, i] <= reach_m)
                least = min(np.pi * radii[i] * LEAST_DEPTH_M**2, 0.5 * sum(part.volume_m3 for part in parts))
                ramps.append(
                    Ramp(
                        center=pose.sphere_centers_m[i],
                        radius=float(radii[i]),
                        along=along.direction,
                        overlaps=[parts[k].overlap for k in met],
                        entries=entries[met, i],
                        least=float(least),
                        sooner_m=early_m + (float(inflated_m[i]) if bare else 0.0),
                        later_m=float(inflated_m[i] - min(expected_m, inflated_m[i])),
                        touchable=touchable,
                    )
                )
            # What overlaps already counts uninflated, too.
            swollen = (entries == 0.0).any(axis=0)
    for ramp in sorted(ramps, key=lambda ramp: ramp.start - ramp.sooner_m):
        begins = ramp.start - MARGIN_M - ramp.sooner_m
        slowly = begins + ramp.later_m < ways_m[1, TOUCH_STRENGTH - 1] if ramp.touchable else begins < ways_m[1, -1]
        if not slowly and begins >= ways_m[0, -1]:
            continue
        own_m = ramp.ways(MARGIN_M, along.reach_m + MARGIN_M) - ramp.sooner_m
        ways_m[0] = np.minimum(ways_m[0], own_m)
        if ramp.touchable:
            own_m = np.where(np.arange(STRENGTHS) < TOUCH_STRENGTH, own_m + ramp.later_m, np.inf)
        ways_m[1] = np.minimum(ways_m[1], own_m)
    return np.where(ways_m > along.reach_m, np.inf, ways_m)


def _overlap(function: Callable[..., tuple[FloatArray, ...]], *shape: FloatArray) -> Overlaps:
    rows = [np.asarray(one)[None] for one in shape]

    def overlap(centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        volumes, gradients, _ = function(centers, radii, *rows, gradient=True)
        return volumes, gradients

    return overlap


def _ways_to_sphere(center: FloatArray, radius: float) -> Ways:
    def ways(centers: FloatArray, radii: FloatArray, along: FloatArray, reach_m: float) -> FloatArray:
        del reach_m
        offset, both = center - centers, radius + radii
        ahead, apart = offset @ along, np.einsum("mi,mi->m", offset, offset) - both**2
        inside = ahead**2 - apart
        found = np.maximum(apart / (ahead + np.sqrt(np.maximum(inside, 0.0))), LEAST_WAY_M)
        found = np.where((ahead <= 0.0) | (inside < 0.0), np.inf, found)
        return np.where(apart < -2.0 * both * TOUCHING_M, 0.0, found)

    return ways


def _ways_to_half_space(normal: FloatArray, offset: float) -> Ways:
    def ways(centers: FloatArray, radii: FloatArray, along: FloatArray, reach_m: float) -> FloatArray:
        del reach_m
        gap, closing = centers @ normal - offset - radii, -float(normal @ along)
        found = np.maximum(gap / closing, LEAST_WAY_M) if closing > CLOSING else np.full(len(gap), np.inf)
        return np.where(gap < -TOUCHING_M, 0.0, found)

    return ways


def _advance(nearest: Nearest) -> Ways:
    """Advance conservatively to what is convex: again and again to the plane that touches it at its nearest point."""

    def ways(centers: FloatArray, radii: FloatArray, along: FloatArray, reach_m: float) -> FloatArray:
        moved, found = np.zeros(len(radii)), np.full(len(radii), np.nan)
        for _ in range(MOST_STEPS):
            going = np.flatnonzero(np.isnan(found))
            if not going.size:
                break
            distances, towards = nearest(centers[going] + moved[going, None] * along)
            gap, closing = distances - radii[going], towards @ along
            step = np.where(closing > CLOSING, gap / np.where(closing > CLOSING, closing, 1.0), np.inf)
            touches = gap <= TOUCHING_M
            ended = np.where(
                closing <= CLOSING, np.inf, np.where(touches, np.maximum(moved[going], LEAST_WAY_M), np.nan)
            )
            ended = np.where(gap < -TOUCHING_M, moved[going], ended)
            further = np.isnan(ended)
            moved[going[further]] += step[further]
            ended[further & (moved[going] > reach_m)] = np.inf
            found[going] = ended
        return np.where(np.isnan(found), moved, found)

    return ways


def _nearest_on(corners: FloatArray, triangles: IntArray) -> Nearest:
    """Ask how far the surface of a solid is, whose triangles face outwards if the corners are right-handed."""
    edges = corners[triangles[0]] - corners.mean(axis=0)
    library = _library(corners.tobytes(), (triangles if np.linalg.det(edges) > 0.0 else triangles[:, ::-1]).tobytes())

    def nearest(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        count = len(points)
        turns = np.ascontiguousarray(np.broadcast_to(np.eye(3), (count, 3, 3)))
        return nearest_mesh_pairs(points, library, np.zeros(count, np.int64), np.zeros((count, 3)), turns)

    return nearest


@lru_cache(maxsize=1000)
def _library(corners: bytes, triangles: bytes) -> MeshLibrary:
    """Keep the surfaces of what stands still."""
    return MeshLibrary([Mesh(np.frombuffer(corners).reshape(-1, 3), np.frombuffer(triangles, np.int64).reshape(-1, 3))])
