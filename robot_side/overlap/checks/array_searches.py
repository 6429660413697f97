"""Compiled searches for what is wrong with whole arrays: checking them takes a small share of working with them."""

import math

from common.arrays import FloatArray
from robot_side.compiled.kernel import COUNT, NUMBER, compiled, inlined, input_array

NONE = -1
"""What the searches return if nothing is wrong."""


@compiled(input_array(1), NUMBER, NUMBER, returns=COUNT)
def first_outside(values: FloatArray, lowest: float, highest: float) -> int:
    """The first of `values` (k,) that is below `lowest`, above `highest` or NaN."""
    outside = 0
    for index in range(values.size):
        outside += 0 if _within(values[index], lowest, highest) else 1
    # Counting them all takes vector instructions, stopping at one does not.
    if outside > 0:
        for index in range(values.size):
            if not _within(values[index], lowest, highest):
                return index
    return NONE


@compiled(input_array(2), NUMBER, returns=COUNT)
def first_short(vectors: FloatArray, least: float) -> int:
    """The first of `vectors` (k, 3) that is shorter than `least`."""
    for index in range(vectors.shape[0]):
        if math.hypot(math.hypot(vectors[index, 0], vectors[index, 1]), vectors[index, 2]) < least:
            return index
    return NONE


@compiled(input_array(3), NUMBER, returns=COUNT)
def first_skewed(rotations: FloatArray, most: float) -> int:
    """The first of `rotations` Q (k, 3, 3) with a Frobenius norm of QᵀQ - I above `most`."""
    for index in range(rotations.shape[0]):
        excess_2 = 0.0
        for row in range(3):
            for column in range(3):
                product = -1.0 if row == column else 0.0
                for axis in range(3):
                    product += rotations[index, axis, row] * rotations[index, axis, column]
                excess_2 += product * product
        if excess_2 > most * most:
            return index
    return NONE


@inlined
def _within(value: float, lowest: float, highest: float) -> bool:
    return (value >= lowest) & (value <= highest)
