"""What every scalar kernel returns: the trivial answers, and the sum over faces with its bounds."""

import math

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, negative

Overlap = tuple[float, Vector, float]
"""(V in m³, dV/dcentre in m², dV/dradius in m²)."""
Overlaps = tuple[FloatArray, FloatArray, FloatArray]
"""Those of many pairs: (volumes (p,), gradients (p, 3), areas (p,))."""


@inlined
def nothing() -> Overlap:
    """The sphere and the solid have no volume in common."""
    return 0.0, (0.0, 0.0, 0.0), 0.0


@inlined
def whole_solid(solid_volume: float) -> Overlap:
    """The solid lies within the sphere."""
    return solid_volume, (0.0, 0.0, 0.0), 0.0


@inlined
def whole_sphere(radius: float) -> Overlap:
    """The sphere lies within the solid."""
    return sphere_volume(radius), (0.0, 0.0, 0.0), sphere_area(radius)


@inlined
def sphere_volume(radius: float) -> float:
    """The volume of a sphere (m³)."""
    return 4.0 / 3.0 * math.pi * radius * radius * radius


@inlined
def sphere_area(radius: float) -> float:
    """The area of a sphere (m²)."""
    return 4.0 * math.pi * radius * radius


@inlined
def from_faces(moment: float, push: Vector, covered: float, radius: float) -> Overlap:
    """Eq. 11 as a sum over the faces of a closed surface, with its gradients, as the sum comes out.

    `moment` is Σ h·A (m³), `push` Σ A·n (m²) and `covered` Σ S (m²), with h a face's signed distance from the
    centre, n its outward normal, A its area inside the ball and S the sphere's surface that it covers. The
    volume is the divergence theorem's, with the origin at the centre. Moving the centre by δ moves the faces
    by -δ against the sphere, hence dV/dcentre = -Σ A·n; a growing sphere gains volume only where its surface
    lies within the solid, hence dV/dradius = Σ S.
    """
    return (moment + radius * covered) / 3.0, negative(push), covered


@inlined
def bounded(overlap: Overlap, radius: float, solid_volume: float) -> Overlap:
    """`overlap` with 0 <= V <= min(sphere's volume, `solid_volume`) and 0 <= dV/dradius <= sphere's area.

    The terms of a sum over faces are of the order of the sphere's volume and each rounds at some 1e-16 of
    it, so a sum that ought to be 0, or the whole of the smaller volume, can pass that by as much; a closed
    form can by its last digit. The bounds take off just that.
    """
    volume, gradient, area = overlap
    most = min(sphere_volume(radius), solid_volume)
    return min(max(volume, 0.0), most), gradient, min(max(area, 0.0), sphere_area(radius))
