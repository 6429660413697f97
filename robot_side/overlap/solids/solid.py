"""Results that the overlap kernels share: nothing, a whole solid or sphere, and a sum over faces with its bounds."""

import math

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, negative

Overlap = tuple[float, Vector, float]
"""Overlap of one sphere and one solid: (V in m³, dV/dcentre in m², dV/dradius in m²)"""
Overlaps = tuple[FloatArray, FloatArray, FloatArray]
"""Overlaps of many pairs: (volumes (p,), gradients (p, 3), areas (p,)), in the same units"""


@inlined
def nothing() -> Overlap:
    """Return the overlap of a sphere and a solid without common volume."""
    return 0.0, (0.0, 0.0, 0.0), 0.0


@inlined
def whole_solid(solid_volume: float) -> Overlap:
    """Return the overlap of a solid that lies within the sphere."""
    return solid_volume, (0.0, 0.0, 0.0), 0.0


@inlined
def whole_sphere(radius: float) -> Overlap:
    """Return the overlap of a sphere that lies within the solid."""
    return sphere_volume(radius), (0.0, 0.0, 0.0), sphere_area(radius)


@inlined
def sphere_volume(radius: float) -> float:
    """Return the volume of a sphere (m³)."""
    return 4.0 / 3.0 * math.pi * radius * radius * radius


@inlined
def sphere_area(radius: float) -> float:
    """Return the area of a sphere (m²)."""
    return 4.0 * math.pi * radius * radius


@inlined
def from_faces(moment: float, push: Vector, covered: float, radius: float) -> Overlap:
    """Return the overlap (eq. 11) with its derivatives from sums over the faces of a closed surface, without bounds.

    `moment` is Σ h·A (m³), `push` Σ A·n (m²) and `covered` Σ S (m²). h is a face's signed distance from the sphere's
    centre, n its outward normal, A its area inside the ball. S is the part of the sphere's surface that the face
    covers (see `face_angles`). The volume follows from the divergence theorem, with the origin at the centre. A step δ
    of the centre moves the faces by -δ relative to the sphere, hence dV/dcentre = -Σ A·n. A growing sphere gains volume
    only where its surface lies within the solid, hence dV/dradius = Σ S.
    """
    return (moment + radius * covered) / 3.0, negative(push), covered


@inlined
def bounded(overlap: Overlap, radius: float, solid_volume: float) -> Overlap:
    """Bound `overlap` to 0 <= V <= min(sphere's volume, `solid_volume`) and 0 <= dV/dradius <= sphere's area.

    The terms of a sum over faces are of the order of the sphere's volume, and each has a rounding error of some 1e-16
    of it. So a sum may lie below 0, or above the smaller volume, by as much. A closed form may do so by its last digit.
    """
    volume, gradient, area = overlap
    most = min(sphere_volume(radius), solid_volume)
    return min(max(volume, 0.0), most), gradient, min(max(area, 0.0), sphere_area(radius))
