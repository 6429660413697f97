"""Which candidate pairs really touch: the others overlap by nothing and need no further look."""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import COUNT, compiled, input_array, input_indices, output_indices
from robot_side.pairs.candidates import CandidatePairs
from robot_side.pairs.overlaps import NearestSurfaces

_REACH = 1.0 + 1e-9
"""Radii are enlarged by this for the comparison with distances, so that rounding leaves out no pair that touches."""


def touching_pairs(
    pairs: CandidatePairs, nearest: NearestSurfaces, pair_radii_m: FloatArray, excluded: int | None = None
) -> tuple[CandidatePairs, NearestSurfaces, FloatArray]:
    """Those of the pairs whose enlarged sphere reaches its primitive: all others overlap by nothing.

    pair_radii_m (p,) as for `evaluate`; pairs with the object `excluded` are left out, too.
    """
    rows, ends = np.empty(len(pairs), dtype=np.int64), np.empty(4, dtype=np.int64)
    kinds = np.array((pairs.boxes.start, pairs.tetrahedra.start, pairs.meshes.start, pairs.half_spaces.start))
    count = _touching_rows(
        nearest.signed_distance_m,
        pair_radii_m,
        pairs.object_index,
        -1 if excluded is None else excluded,
        kinds,
        rows,
        ends,
    )
    if count == len(pairs):
        return pairs, nearest, pair_radii_m
    rows = rows[:count]
    first_box, first_tetrahedron, first_mesh, first_half_space = ends.tolist()
    return (
        CandidatePairs(
            pairs.sphere_index.take(rows),
            pairs.primitive_index.take(rows),
            pairs.object_index.take(rows),
            slice(0, first_box),
            slice(first_box, first_tetrahedron),
            slice(first_tetrahedron, first_mesh),
            slice(first_mesh, first_half_space),
            slice(first_half_space, count),
            pairs.pairs_skipped,
        ),
        NearestSurfaces(
            nearest.signed_distance_m.take(rows),
            nearest.direction.take(rows, axis=0),
            nearest.deepening.take(rows, axis=0),
        ),
        pair_radii_m.take(rows),
    )


@compiled(
    input_array(1),
    input_array(1),
    input_indices(),
    COUNT,
    input_indices(),
    output_indices(),
    output_indices(),
    returns=COUNT,
)
def _touching_rows(
    distances: FloatArray,
    radii: FloatArray,
    object_index: IntArray,
    excluded: int,
    kinds: IntArray,
    rows: IntArray,
    first_rows: IntArray,
) -> int:
    """Write the rows of the pairs that touch, and in `first_rows` where the kinds that began at `kinds` do.

    The number of rows.
    """
    count = 0
    kind = 0
    for pair in range(distances.size):
        while kind < kinds.size and kinds[kind] == pair:
            first_rows[kind] = count
            kind += 1
        if distances[pair] <= radii[pair] * _REACH and object_index[pair] != excluded:
            rows[count] = pair
            count += 1
    first_rows[kind:] = count
    return count
