"""Errors of surfaces, from those of the pixels that made them (docs/feel.md)."""

from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.depth.boxes import Boxes
from robot_side.depth.picture import DepthErrors

_LEAST_M: Final = 1e-4


def surface_sds(boxes: Boxes, planes: IntArray, errors: DepthErrors) -> FloatArray:
    """Return the standard deviation of each surface's place (n,), in m, by the errors of its pixels alone.

    A surface is a mean over n patches of its area whose errors are independent, σ² = σ_px² / n. Pixels nearer to each
    other than twice the correlation length are of one patch; without such a length n is 1. Pieces of one plane share
    what their areas weigh.
    """
    sds_m = boxes.sds_m
    sides_m = 2.0 * boxes.half_sizes_m[:, :2]
    patches = np.ones(len(sds_m))
    if errors.correlation > 0.0 and errors.growth_per_m > 0.0:
        away_m = np.sqrt(np.maximum(sds_m - errors.floor_m, 0.0) / errors.growth_per_m)
        length_m = np.maximum(2.0 * errors.correlation * away_m, _LEAST_M)
        patches = np.maximum(sides_m / length_m[:, None], 1.0).prod(axis=1)
    variances_m2 = sds_m * sds_m / patches
    areas_m2 = sides_m.prod(axis=1)
    sums_m4 = np.bincount(planes, areas_m2 * variances_m2), np.bincount(planes, areas_m2)
    shared: FloatArray = np.sqrt(sums_m4[0] / sums_m4[1])[planes]
    return shared
