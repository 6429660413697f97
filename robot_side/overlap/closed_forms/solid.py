"""Results of all scalar kernels: the trivial ones, and the sum over faces with its bounds."""

import math

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, negative

Overlap = tuple[float, Vector, float]
"""(V in m³, dV/dcentre in m², dV/dradius in m²)."""
Overlaps = tuple[FloatArray, FloatArray, FloatArray]
"""The overlaps of many pairs: (volumes (p,), gradients (p, 3), areas (p,))."""


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
    """Return eq. 11 as a sum over the faces of a closed surface, with the gradients, without bounds.

    `moment` is Σ h·A (m³), `push` Σ A·n (m²) and `covered` Σ S (m²). h is a face's signed distance from the centre, n
    its outward normal, A its area inside the ball and S the sphere's surface that it covers. The volume follows from
    the divergence theorem, with the origin at the centre. A step δ of the centre moves the faces by -δ against the
    sphere, hence dV/dcentre = -Σ A·n. A growing sphere gains volume only where its surface lies within the solid,
    hence dV/dradius = Σ S.
    """
    return (moment + radius * covered) / 3.0, negative(push), covered


@inlined
def bounded(overlap: Overlap, radius: float, solid_volume: float) -> Overlap:
    """Bound `overlap` to 0 <= V <= min(sphere's volume, `solid_volume`) and 0 <= dV/dradius <= sphere's area.

    The terms of a sum over faces are of the order of the sphere's volume, and each rounds at some 1e-16 of it. So a
    sum can lie below 0, or above the smaller volume, by as much; a closed form by its last digit.
    """
    volume, gradient, area = overlap
    most = min(sphere_volume(radius), solid_volume)
    return min(max(volume, 0.0), most), gradient, min(max(area, 0.0), sphere_area(radius))
