"""Each picture's sums become part of the surfels' means, and of what speaks for them."""

from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import (
    BOOL,
    array_of,
    building_block,
    compiled,
    input_array,
    input_indices,
    output_indices,
)
from robot_side.compiled.vectors import Vector, dot, load, norm, scale, subtract, unit
from robot_side.depth.grid import block_of
from robot_side.depth.surfel_map.folding import mean_normal, mean_point
from robot_side.depth.surfel_map.surfel_columns import Count, SurfelColumns, surfels_at
from robot_side.depth.view import camera_position, sd_at

_SIGMAS: Final = 3.0
MOST_WEIGHT: Final = 16.0
"""Number of pictures that a mean is worth at most, so that it follows what changes"""
APPEARS: Final = 2
"""Pictures after which a surfel is shown"""
MOST_EVIDENCE: Final = 3
"""Pictures against it after which a surfel is gone, at most"""
_ASTRAY: Final = 3
"""Successive pictures that put a surfel elsewhere after which it is there"""
_NEARER: Final = 0.7
"""Share of a surfel's error below which it is looked at again, as it was seen from nearer"""
_SETTLED: Final = 4.0
"""Number of pictures that a mean is worth when its surface is looked at again"""
_NOISE: Final = 0.6
"""Share of a pixel's variance that shows within a surface, as neighbours' errors are alike"""
_GRAZING: Final = 0.04
"""Least square of the cosine between a ray and a normal that counts"""
_MOVED_M: Final = 0.0005
"""Motion of a surfel, beyond the standard deviation of a pixel, that makes its surface be looked at again"""
DIRTY: Final = array_of(np.uint8, 1)
"""Numba type of the blocks' marks (b,): 1 where surfaces are to be looked for again"""


@building_block
def _average_spread(
    surfels: SurfelColumns, row: int, share: float, small_m2: float, ray: Vector, facing: Vector
) -> None:
    """Add the covariance of the newest picture's points to the mean; small_m2: variance within a pixel."""
    slant = dot(ray, facing)
    # A pixel is a small rectangle on the surface, longer the more the view grazes it.
    across, longer = subtract(ray, scale(slant, facing)), small_m2 / max(slant * slant, _GRAZING)
    sums, by = surfels.sums, 1.0 / surfels.sums[row, 0]
    for i, j, place in ((0, 0, 0), (1, 1, 1), (2, 2, 2), (0, 1, 3), (0, 2, 4), (1, 2, 5)):
        pixel = (small_m2 if i == j else 0.0) - small_m2 * facing[i] * facing[j] + longer * across[i] * across[j]
        spread = by * sums[row, 4 + place] - by * by * sums[row, 1 + i] * sums[row, 1 + j] + pixel
        surfels.spreads_m2[row, place] += share * (spread - surfels.spreads_m2[row, place])


@compiled(
    *(input_array(1), BOOL, input_array(1), input_indices(), BUNDLE, output_indices(), DIRTY),
)
def merge(
    view: FloatArray,
    labelled: bool,
    place: FloatArray,
    cells: IntArray,
    bundle: IntArray,
    counts: IntArray,
    dirty: np.ndarray,
) -> None:
    """Merge the sums of the newest picture into its surfels."""
    surfels, edge = surfels_at(bundle), place[3]
    for t in range(counts[Count.TOUCHED]):
        row = surfels.touched[t]
        sums = surfels.sums
        point, normal = mean_point(surfels, place, row), mean_normal(surfels, view, row)
        sd, pixel = sd_at(view, sums[row, 13]), sums[row, 13] / view[0]
        noise = _NOISE * sd * sd
        weight, new, astray = surfels.weights[row], 1.0, False
        if weight > 0.0:
            # A picture counts by its variance, against that of the best.
            best = surfels.sds_m[row]
            if sd < best:
                weight *= (sd / best) ** 2
            elif sd > 0.0:
                new = (best / sd) ** 2
            away = dot(subtract(point, load(surfels.points_m, row)), unit(normal))
            # Pixels' errors are alike, so that their mean errs by about as much as each.
            astray = abs(away) > _SIGMAS * (sd + best) + 0.001
        surfels.astray[row] = surfels.astray[row] + 1 if astray else 0
        if weight == 0.0 or surfels.astray[row] >= _ASTRAY:
            weight, new, surfels.sds_m[row], surfels.astray[row] = 0.0, 1.0, sd, 0
        share = new / (weight + new)
        surfels.weights[row] = min(weight + new, MOST_WEIGHT)
        surfels.sds_m[row] = min(surfels.sds_m[row], sd)
        surfels.noise_m2[row] += (
            share * (noise - surfels.noise_m2[row]) if weight > 0.0 else noise - surfels.noise_m2[row]
        )
        for k in range(3):
            surfels.points_m[row, k] += share * (point[k] - surfels.points_m[row, k])
            surfels.normals[row, k] += share * (normal[k] - surfels.normals[row, k])
        facing, ray = unit(normal), unit(subtract(point, camera_position(view)))
        _average_spread(surfels, row, share, pixel * pixel / 12.0, ray, facing)
        surfels.evidence[row] = min(surfels.evidence[row] + 1, MOST_EVIDENCE)
        surfels.unanswered_s[row] = 0.0
        changed = False
        if labelled and surfels.pointed[row] == 0 and surfels.roles[row] != surfels.candidates[row]:
            surfels.roles[row] = surfels.candidates[row]
            changed = True
        if not surfels.shown[row] and surfels.evidence[row] >= APPEARS:
            surfels.shown[row] = 1
            changed = True
        elif surfels.shown[row]:
            away_from = subtract(load(surfels.points_m, row), load(surfels.looked_m, row))
            along = abs(dot(away_from, unit(load(surfels.normals, row))))
            changed = changed or along > _MOVED_M + surfels.sds_m[row] or norm(away_from) > 0.4 * edge
            changed = changed or surfels.sds_m[row] < _NEARER * surfels.looked_m[row, 3]
            # Its first mean is rough.
            changed = changed or weight < _SETTLED <= surfels.weights[row]
        if changed and surfels.shown[row]:
            dirty[block_of(cells, surfels.cells[row])] = 1
