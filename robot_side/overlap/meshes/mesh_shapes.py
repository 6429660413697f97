"""Closed meshes that contain cylinders, ellipsoids and capsules, with the excess of their volume; convex hulls.

They are not smaller than the solid anywhere, except that rounding may move a vertex by its last digit.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull, QhullError

from common.arrays import FloatArray, IntArray


class ShapeMesh(NamedTuple):
    """Mesh that contains a solid, and by how much it is larger."""

    vertices: FloatArray
    """Corners (v, 3) in m"""
    triangles: IntArray
    """Indices of each triangle's corners (t, 3), anticlockwise as seen from outside"""
    excess: float
    """Excess of the mesh's volume over the solid's, as a share of the solid's"""
    stands_out_m: float
    """Upper bound of the distance by which the mesh protrudes from the solid"""


def cylinder_mesh(radius: float, half_length: float, segments: int = 32) -> ShapeMesh:
    """Return a prism around the cylinder of `radius` about the z axis, |z| <= half_length; all in m.

    Each of the `segments` sides touches the cylinder. The excess is that of a circumscribed polygon of n sides:
    (n / π) tan(π / n) - 1.
    """
    turns = 2.0 * np.pi * np.arange(segments) / segments
    reach = radius / np.cos(np.pi / segments)
    ring = np.column_stack([reach * np.cos(turns), reach * np.sin(turns)])
    ends = [np.column_stack([ring, np.full(segments, z)]) for z in (-half_length, half_length)]
    excess = segments / np.pi * np.tan(np.pi / segments) - 1.0
    vertices = np.concatenate(ends)
    return ShapeMesh(vertices, _outward_hull(vertices), float(excess), float(reach - radius))


def ellipsoid_mesh(semi_axes: npt.ArrayLike, subdivisions: int = 8) -> ShapeMesh:
    """Return a polyhedron around the ellipsoid Σ (xᵢ / semi_axesᵢ)² <= 1, `semi_axes` (3,) in m.

    An octahedron in a sphere, each edge divided by `subdivisions`, is enlarged until no face cuts the sphere, and then
    stretched. The excess is computed exactly, from the polyhedron's volume.
    """
    axes = np.asarray(semi_axes, dtype=np.float64)
    unit = _round(subdivisions, 0.0)
    return unit._replace(vertices=unit.vertices * axes, stands_out_m=unit.stands_out_m * float(axes.max()))


def capsule_mesh(radius: float, half_length: float, subdivisions: int = 8) -> ShapeMesh:
    """Return a polyhedron around a capsule: the points within `radius` of the z axis' segment |z| <= half_length, in m.

    It consists of the halves of an `ellipsoid_mesh` of equal axes, moved apart, and a prism between them.
    """
    unit = _round(subdivisions, half_length / radius)
    return unit._replace(vertices=unit.vertices * radius, stands_out_m=unit.stands_out_m * radius)


def convex_hull_mesh(points: npt.ArrayLike) -> ShapeMesh:
    """Return the convex hull of `points` (n, 3) in m, with its corners as the only vertices.

    ValueError for points that are all in one plane.
    """
    places = np.asarray(points, dtype=np.float64)
    try:
        hull = ConvexHull(places)
    except (QhullError, ValueError) as error:
        raise ValueError(
            f"points ({len(places)}, 3) have no convex hull; valid: 4 or more, not in one plane"
        ) from error
    vertices = places[hull.vertices]
    return ShapeMesh(vertices, _outward_hull(vertices), 0.0, 0.0)


def _outward_hull(vertices: FloatArray) -> IntArray:
    """Return the triangles (t, 3) of the convex hull, anticlockwise as seen from outside."""
    hull = ConvexHull(vertices)
    corners = vertices[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.sum(normals * hull.equations[:, :3], axis=1) < 0.0
    triangles = np.array(hull.simplices, dtype=np.int64)
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles


def _round(subdivisions: int, half_length: float) -> ShapeMesh:
    """Return a mesh around the unit sphere whose halves are moved along z by ±half_length, with a prism in between."""
    steps = range(-subdivisions, subdivisions + 1)
    lattice = [(x, y, z) for x in steps for y in steps for z in steps if abs(x) + abs(y) + abs(z) == subdivisions]
    directions = np.array(lattice, dtype=np.float64)
    level = np.flatnonzero(directions[:, 2] == 0.0)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    triangles = _outward_hull(directions)
    nearest = _face_distances(directions, triangles).min()
    vertices = directions / nearest
    if half_length > 0.0:
        vertices[:, 2] += np.copysign(half_length, vertices[:, 2]) * (vertices[:, 2] != 0.0)
        shift = np.array([0.0, 0.0, half_length])
        waist = vertices[level]
        vertices = np.concatenate([np.delete(vertices, level, axis=0), waist + shift, waist - shift])
        triangles = _outward_hull(vertices)
    solid = np.pi * (4.0 / 3.0 + 2.0 * half_length)
    corners = vertices[triangles]
    volume = np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])) / 6.0
    return ShapeMesh(vertices, triangles, float(volume / solid - 1.0), float(1.0 / nearest - 1.0))


def _face_distances(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the distances (t,) of the triangles' planes from the origin."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    return np.asarray(np.abs(np.sum(a * normals, axis=1)) / np.linalg.norm(normals, axis=1))
