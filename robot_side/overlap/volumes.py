"""Exact overlap of spheres with simple solids (eq. 11 and 12); arguments are checked and broadcast.

In every function `centers` (..., 3) and `radii` (...) in m describe the spheres, and all leading dimensions
broadcast: centers (m, 1, 3) with vertices (k, 4, 3) give results (m, k). The functions return the volumes (...) in
m³. With `gradient=True` they return the tuple (volumes (...), gradients (..., 3), areas (...)):

- gradients, dV/dcentre in m²: the direction in which moving the sphere increases the overlap fastest;
- areas, dV/dradius in m²: the part of the sphere's surface that lies within the solid.

Above 262 144 pairs, arguments are broadcast in blocks. So memory grows with the results alone: by 8 bytes a pair, and
by 40 with gradients.

Where a derivative jumps, as for equal spheres at the same place, the value of one side is returned. A solid without
volume, or a radius of 0, gives 0 for all results.

ValueError for NaN, infinity, a magnitude above 1e50, a negative radius or size, a wrong or incompatible shape. Its text
names the argument, the value and the valid range.

For all ratios of sizes and all distances from the origin, the error of a volume is at most 1e-15 of the sphere's
volume. That of a gradient is at most 2e-15 of the great circle's area, and that of an area 1e-15 of the sphere's
surface. Overlaps below a millionth of the sphere have a relative error of 1e-9 or less; for slivers and needles this
holds down to 1e-12 of the sphere. docs/benchmarks.md has the figures.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal, overload

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from robot_side.overlap.checks.arguments import (
    Argument,
    Check,
    blocks,
    broadcast,
    directions,
    lengths,
    numbers,
    plain_rows,
    rotations,
)
from robot_side.overlap.kernels import (
    DoubtfulNumbersError,
    box_pairs,
    half_space_pairs,
    sphere_pairs,
    tetrahedron_pairs,
)
from robot_side.overlap.solids.solid import Overlaps

Array = npt.ArrayLike


@overload
def sphere_sphere(
    centers: Array,
    radii: Array,
    other_centers: Array,
    other_radii: Array,
    *,
    gradient: Literal[False] = False,
) -> FloatArray: ...
@overload
def sphere_sphere(
    centers: Array, radii: Array, other_centers: Array, other_radii: Array, *, gradient: Literal[True]
) -> Overlaps: ...
def sphere_sphere(
    centers: Array, radii: Array, other_centers: Array, other_radii: Array, *, gradient: bool = False
) -> FloatArray | Overlaps:
    """Return the overlap of spheres with the spheres `other_centers` (..., 3), `other_radii` (...) in m.

    The module's docstring describes arguments and results.
    """
    return _overlaps(_SPHERES, (centers, radii, other_centers, other_radii), gradient)


@overload
def sphere_half_space(
    centers: Array, radii: Array, normals: Array, offsets: Array, *, gradient: Literal[False] = False
) -> FloatArray: ...
@overload
def sphere_half_space(
    centers: Array, radii: Array, normals: Array, offsets: Array, *, gradient: Literal[True]
) -> Overlaps: ...
def sphere_half_space(
    centers: Array, radii: Array, normals: Array, offsets: Array, *, gradient: bool = False
) -> FloatArray | Overlaps:
    """Return the overlap of spheres with the half-spaces normal · x <= offset, V_c of eq. 12.

    `normals` (..., 3) need not have unit length, but must not be 0; `offsets` (...). The module's docstring describes
    arguments and results.
    """
    return _overlaps(_HALF_SPACES, (centers, radii, normals, offsets), gradient)


@overload
def sphere_box(
    centers: Array,
    radii: Array,
    box_centers: Array,
    box_rotations: Array,
    box_half_sizes: Array,
    *,
    gradient: Literal[False] = False,
) -> FloatArray: ...
@overload
def sphere_box(
    centers: Array,
    radii: Array,
    box_centers: Array,
    box_rotations: Array,
    box_half_sizes: Array,
    *,
    gradient: Literal[True],
) -> Overlaps: ...
def sphere_box(
    centers: Array,
    radii: Array,
    box_centers: Array,
    box_rotations: Array,
    box_half_sizes: Array,
    *,
    gradient: bool = False,
) -> FloatArray | Overlaps:
    """Return the overlap of spheres with the boxes {c + Q diag(half) x : |xᵢ| <= 1}.

    `box_centers` c (..., 3) in m, `box_rotations` Q (..., 3, 3) from the box's frame to the spheres',
    `box_half_sizes` half (..., 3) in m. Q is used as given, even where rounding makes it not quite a rotation;
    ValueError for ‖QᵀQ - I‖ > 1e-6 (Frobenius). The module's docstring describes arguments and results.
    """
    return _overlaps(_BOXES, (centers, radii, box_centers, box_rotations, box_half_sizes), gradient)


@overload
def sphere_tetrahedron(
    centers: Array, radii: Array, vertices: Array, *, gradient: Literal[False] = False
) -> FloatArray: ...
@overload
def sphere_tetrahedron(centers: Array, radii: Array, vertices: Array, *, gradient: Literal[True]) -> Overlaps: ...
def sphere_tetrahedron(
    centers: Array, radii: Array, vertices: Array, *, gradient: bool = False
) -> FloatArray | Overlaps:
    """Return the overlap of spheres with the tetrahedra of `vertices` (..., 4, 3) in m, in any order.

    The module's docstring describes arguments and results.
    """
    return _overlaps(_TETRAHEDRA, (centers, radii, vertices), gradient)


@dataclass(frozen=True)
class _Kind:
    """One kind of solid: the overlap function, and for each argument its check, name and trailing dimensions."""

    pairs: Callable[..., Overlaps]
    arguments: tuple[tuple[Check, str, tuple[int, ...]], ...]

    @cached_property
    def trailing(self) -> tuple[tuple[int, ...], ...]:
        return tuple(trailing for _, _, trailing in self.arguments)


MOST_AT_ONCE = 1 << 18
"""Number of pairs above which arguments are broadcast in blocks, so that memory grows with the results alone"""
_TRAILING: Final = (), (3,), ()
"""Trailing dimensions of volumes, gradients and areas"""

_CENTERS_AND_RADII = (numbers, "centers", (3,)), (lengths, "radii", ())
_SPHERES = _Kind(sphere_pairs, (*_CENTERS_AND_RADII, (numbers, "other_centers", (3,)), (lengths, "other_radii", ())))
_HALF_SPACES = _Kind(half_space_pairs, (*_CENTERS_AND_RADII, (directions, "normals", (3,)), (numbers, "offsets", ())))
_BOXES = _Kind(
    box_pairs,
    (
        *_CENTERS_AND_RADII,
        (numbers, "box_centers", (3,)),
        (rotations, "box_rotations", (3, 3)),
        (lengths, "box_half_sizes", (3,)),
    ),
)
_TETRAHEDRA = _Kind(tetrahedron_pairs, (*_CENTERS_AND_RADII, (numbers, "vertices", (4, 3))))


def _overlaps(kind: _Kind, given: tuple[Array, ...], gradient: bool) -> FloatArray | Overlaps:
    # Plain arrays go directly to the kernels, which also detect doubtful numbers.
    plain = plain_rows(given, kind.trailing)
    if plain is not None and len(plain[0][0]) <= MOST_AT_ONCE:
        rows, shape = plain
        try:
            return _result(kind.pairs(*rows, trusted=False), shape, gradient)
        except DoubtfulNumbersError:
            pass
    arguments = [check(name, value, last) for (check, name, last), value in zip(kind.arguments, given, strict=True)]
    shape = broadcast(arguments)
    if math.prod(shape) > MOST_AT_ONCE:
        return _in_blocks(kind, arguments, shape, gradient)
    return _result(kind.pairs(*(argument.rows(shape) for argument in arguments)), shape, gradient)


def _in_blocks(
    kind: _Kind, arguments: Sequence[Argument], shape: tuple[int, ...], gradient: bool
) -> FloatArray | Overlaps:
    """Return the overlaps of very many pairs, of which only a block at a time is broadcast."""
    kept = [np.empty((*shape, *last)) for last in _TRAILING[: None if gradient else 1]]
    for block in blocks(shape, MOST_AT_ONCE):
        parts = [argument.block(shape, block) for argument in arguments]
        size = parts[0].leading
        for whole, found in zip(kept, kind.pairs(*(part.items for part in parts)), strict=False):
            whole[block] = found.reshape(*size, *found.shape[1:])
    return (kept[0], kept[1], kept[2]) if gradient else kept[0]


def _result(overlaps: Overlaps, shape: tuple[int, ...], gradient: bool) -> FloatArray | Overlaps:
    volumes, gradients, areas = overlaps
    if len(shape) == 1:
        return overlaps if gradient else volumes
    if not gradient:
        return volumes.reshape(shape)
    return volumes.reshape(shape), gradients.reshape(*shape, 3), areas.reshape(shape)
