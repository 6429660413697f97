"""Meshes around round solids are closed, contain the solid, and are larger by their stated excess at most."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

from common.arrays import FloatArray
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import (
    ShapeMesh,
    capsule_mesh,
    convex_hull_mesh,
    cylinder_mesh,
    ellipsoid_mesh,
)

AXES = np.array([0.3, 1.0, 2.0])


def _cylinder(points: FloatArray) -> FloatArray:
    return np.asarray(
        points / np.maximum(np.hypot(points[:, 0], points[:, 1]) / 0.5, np.abs(points[:, 2]) / 2.0)[:, None]
    )


def _capsule(points: FloatArray) -> FloatArray:
    on_axis = np.zeros_like(points)
    on_axis[:, 2] = np.clip(3.0 * points[:, 2], -2.0, 2.0)
    return np.asarray(on_axis + 0.5 * points / np.linalg.norm(points, axis=1, keepdims=True))


def _ellipsoid(points: FloatArray) -> FloatArray:
    return np.asarray(AXES * points / np.linalg.norm(points, axis=1, keepdims=True))


SHAPES: dict[str, tuple[Callable[[int], ShapeMesh], float, Callable[[FloatArray], FloatArray]]] = {
    "cylinder": (lambda fineness: cylinder_mesh(0.5, 2.0, 4 * fineness), np.pi * 0.25 * 4.0, _cylinder),
    "capsule": (lambda fineness: capsule_mesh(0.5, 2.0, fineness), np.pi * (0.25 * 4.0 + 0.125 * 4.0 / 3.0), _capsule),
    "ellipsoid": (lambda fineness: ellipsoid_mesh(AXES, fineness), 4.0 / 3.0 * np.pi * float(AXES.prod()), _ellipsoid),
}


def _outside_ellipsoid(point: FloatArray) -> float:
    """Return the distance of `point` from the ellipsoid. The normal at the nearest point x leads to the point p.

    So x_i = a_i² p_i / (a_i² + t).
    """

    def excess(t: float) -> float:
        return float(((AXES * point / (AXES**2 + t)) ** 2).sum()) - 1.0

    t = brentq(excess, 0.0, 1e3, xtol=1e-15)
    return float(np.linalg.norm(t * point / (AXES**2 + t)))


OUTSIDE: dict[str, Callable[[FloatArray], float]] = {
    "cylinder": lambda point: float(max(np.hypot(*point[:2]) - 0.5, abs(point[2]) - 2.0)),
    "capsule": lambda point: float(np.linalg.norm(point - [0.0, 0.0, np.clip(point[2], -2.0, 2.0)]) - 0.5),
    "ellipsoid": _outside_ellipsoid,
}


@pytest.mark.parametrize("fineness", [1, 2, 5, 12])
@pytest.mark.parametrize("name", SHAPES)
def test_the_solid_lies_within_and_the_excess_is_as_stated(name: str, fineness: int) -> None:
    make, volume, surface_points = SHAPES[name]
    vertices, triangles, excess, stands_out_m = make(fineness)
    mesh = Mesh(vertices, triangles)
    assert volume < mesh.volume_m3 <= volume * (1.0 + excess) * (1.0 + 1e-12)
    assert mesh.volume_m3 == pytest.approx(volume * (1.0 + excess), rel=1e-12)
    points = surface_points(np.random.default_rng(1).normal(size=(3000, 3)))
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = np.sum(normals * corners[:, 0], axis=1)
    assert (points @ normals.T - offsets).max() < 1e-12
    # The distance from a convex solid is a convex function, so a vertex of the mesh protrudes farthest.
    farthest_m = max(OUTSIDE[name](vertex) for vertex in vertices[:: max(1, len(vertices) // 100)])
    assert farthest_m <= stands_out_m * (1.0 + 1e-9)
    assert farthest_m > 0.2 * stands_out_m


def test_a_convex_hull_keeps_what_it_needs() -> None:
    rng = np.random.default_rng(2)
    points = np.concatenate([rng.uniform(-0.9, 0.9, (200, 3)), np.array([*np.ndindex(2, 2, 2)]) * 2.0 - 1.0])
    vertices, triangles, excess, stands_out_m = convex_hull_mesh(points)
    assert len(vertices) == 8
    assert excess == stands_out_m == 0.0
    assert Mesh(vertices, triangles).volume_m3 == pytest.approx(8.0)
    for flat in (np.eye(3), [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0.0, np.inf, 0.0]]):
        with pytest.raises(ValueError, match=r"points \(\d, 3\) have no convex hull"):
            convex_hull_mesh(flat)
