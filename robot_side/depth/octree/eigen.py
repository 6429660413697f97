"""Axes of a symmetric matrix of three rows, by Jacobi's rotations."""

import math
from typing import Final

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block

_SWEEPS: Final = 6


@building_block
def principal_axes(matrix: FloatArray, axes: FloatArray) -> None:
    """Turn `matrix` (3, 3) into a diagonal of rising variances, and write its axes (3, 3) as columns."""
    for i in range(3):
        for j in range(3):
            axes[i, j] = 1.0 if i == j else 0.0
    for _ in range(_SWEEPS):
        for turn in range(3):
            i, j = (0, 1) if turn == 0 else ((0, 2) if turn == 1 else (1, 2))
            if abs(matrix[i, j]) <= 1e-18 * (abs(matrix[i, i]) + abs(matrix[j, j])):
                continue
            ratio = 0.5 * (matrix[j, j] - matrix[i, i]) / matrix[i, j]
            tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
            cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
            sine = tangent * cosine
            for k in range(3):
                a, b = matrix[k, i], matrix[k, j]
                matrix[k, i], matrix[k, j] = cosine * a - sine * b, sine * a + cosine * b
            for k in range(3):
                a, b = matrix[i, k], matrix[j, k]
                matrix[i, k], matrix[j, k] = cosine * a - sine * b, sine * a + cosine * b
                a, b = axes[k, i], axes[k, j]
                axes[k, i], axes[k, j] = cosine * a - sine * b, sine * a + cosine * b
    for first in range(2):
        for i in range(2 - first):
            if matrix[i, i] > matrix[i + 1, i + 1]:
                matrix[i, i], matrix[i + 1, i + 1] = matrix[i + 1, i + 1], matrix[i, i]
                for k in range(3):
                    axes[k, i], axes[k, i + 1] = axes[k, i + 1], axes[k, i]
