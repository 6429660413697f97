"""Overlap of a sphere with one primitive of any kind (eq. 11-12).

Short closed forms are inlined. All other kernels are called by their addresses, so that a scene compiles only the
kernels of its own kinds. Boxes, tetrahedra and meshes use the lanes of `robot_side.overlap` without the precise forms,
exact to 1e-13 of the sphere. Ellipsoids use quadrature, exact to about 1e-9. Strengths need only 1e-3.
"""

from collections.abc import Callable
from typing import Any

from common.arrays import FloatArray, IntArray
from robot_side.compiled.calls import call_at_address
from robot_side.compiled.kernel import FLOAT64, inlined
from robot_side.compiled.vectors import Vector
from robot_side.surroundings.kinds.kind import by_kind
from robot_side.surroundings.kinds.layout import OVERLAP
from robot_side.surroundings.perceived import KINDS

_by_address = call_at_address(FLOAT64, OVERLAP)


def _overlap(number: int, closed_form: Callable[..., Any] | None) -> Callable[..., float]:
    @inlined
    def called(
        kernels: IntArray,
        shapes: FloatArray,
        row: int,
        center: Vector,
        radius: float,
        meshes: IntArray,
        overlap_gradient: FloatArray,
    ) -> float:
        found: float = _by_address(kernels[number], (shapes, row, *center, radius, meshes, overlap_gradient))
        return found

    if closed_form is None:
        return called

    @inlined
    def worked_out(
        _kernels: IntArray,
        shapes: FloatArray,
        row: int,
        center: Vector,
        radius: float,
        _meshes: IntArray,
        overlap_gradient: FloatArray,
    ) -> float:
        volume, gradient, _ = closed_form(shapes, row, center, radius)
        overlap_gradient[0], overlap_gradient[1], overlap_gradient[2] = gradient
        found: float = volume
        return found

    return worked_out


_overlap_by_kind = by_kind([_overlap(number, kind.overlap) for number, kind in enumerate(KINDS)])


@inlined
def overlap(
    kind: int,
    kernels: IntArray,
    shapes: FloatArray,
    row: int,
    center: Vector,
    radius: float,
    meshes: IntArray,
    overlap_gradient: FloatArray,
) -> float:
    """Return the overlap V of a sphere and the primitive in `row`; fill `overlap_gradient` (3,) with dV/dcentre.

    kernels: address of each kind's overlap kernel.
    """
    found: float = _overlap_by_kind(kind, kernels, shapes, row, center, radius, meshes, overlap_gradient)
    return found
