"""What each object's overlaps add to the two triggers and to the rumble, before any role bends it (§4.2)."""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import compiled, input_array, input_indices, output_array
from robot_side.pairs.overlaps import Overlaps

Shares = list[float]
"""What one object adds to l2, r2 and rumble: plain numbers, because few objects overlap at once."""


def object_shares(overlaps: Overlaps, aligned: FloatArray, reference_m3: FloatArray) -> dict[int, Shares]:
    """The shares of each object that overlaps, in the objects' order.

    A trigger k gets Σ V a_k / V_ref,k over the object's pairs, aligned (2, p) holding a; the rumble what lies along
    neither, Σ V (1 - max a) / max V_ref. reference_m3 (2,): V_ref, above 0.
    """
    objects = sorted(set(overlaps.object_index.tolist()))
    shares = np.zeros((len(objects), 3))
    _share_loop(overlaps.object_index, overlaps.volume_m3, aligned, np.array(objects), reference_m3, shares)
    return dict(zip(objects, shares.tolist(), strict=True))


@compiled(input_indices(), input_array(1), input_array(2), input_indices(), input_array(1), output_array(2))
def _share_loop(
    object_index: IntArray,
    volumes: FloatArray,
    aligned: FloatArray,
    objects: IntArray,
    references: FloatArray,
    shares: FloatArray,
) -> None:
    for pair in range(volumes.size):
        row = np.searchsorted(objects, object_index[pair])
        l2, r2 = aligned[0, pair], aligned[1, pair]
        shares[row, 0] += l2 * volumes[pair]
        shares[row, 1] += r2 * volumes[pair]
        shares[row, 2] += (1.0 - max(l2, r2)) * volumes[pair]
    for row in range(objects.size):
        shares[row, 0] /= references[0]
        shares[row, 1] /= references[1]
        shares[row, 2] /= max(references[0], references[1])
