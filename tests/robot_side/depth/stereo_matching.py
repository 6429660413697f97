"""A matcher of rectified pairs of pictures: census of 7 x 5 pixels, semi-global in four directions, subpixel steps."""

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from common.arrays import BoolArray, FloatArray

_AROUND: Final = [(i, j) for i in range(-2, 3) for j in range(-3, 4) if (i, j) != (0, 0)]
_STEP: Final = 4.0
"""Cost of one pixel of disparity between neighbours, in bits"""
_JUMP: Final = 24.0
_CLEAR: Final = 0.95
"""Share of the second least cost that the least has at most"""
_AGREE_PX: Final = 1.0
Cost = npt.NDArray[np.float32]


def disparities(left: npt.NDArray[Any], right: npt.NDArray[Any], most: int) -> FloatArray:
    """Return the disparity (h, w) of each pixel of the left grey picture, below `most`; NaN where it is unclear."""
    of_left, of_right = _census(left), _census(right)
    cost: Cost = np.full((*left.shape, most), len(_AROUND), dtype=np.float32)
    for d in range(most):
        cost[:, d:, d] = np.bitwise_count(of_left[:, d:] ^ of_right[:, : left.shape[1] - d])
    total = np.zeros_like(cost)
    for turned in (cost, cost[::-1], cost.swapaxes(0, 1), cost.swapaxes(0, 1)[::-1]):
        summed = total if turned.shape == total.shape else total.swapaxes(0, 1)
        _add_path(turned, summed[::-1] if turned.strides[0] < 0 else summed)
    best = total.argmin(axis=2)
    found: FloatArray = best + _subpixel(total, best)
    found[~(_clear(total, best) & _agreed(total, best))] = np.nan
    return found


def _census(grey: npt.NDArray[Any]) -> npt.NDArray[np.uint64]:
    """Return for each pixel a bit for each neighbour that is darker."""
    bits = np.zeros(grey.shape, dtype=np.uint64)
    for i, j in _AROUND:
        bits = (bits << np.uint64(1)) | (np.roll(grey, (i, j), (0, 1)) < grey)
    return bits


def _add_path(cost: Cost, total: Cost) -> None:
    """Add the least costs (h, w, d) of paths that come down the rows."""
    path = cost[0].copy()
    total[0] += path
    for number, row in enumerate(cost[1:], start=1):
        least = path.min(axis=1, keepdims=True)
        best = np.minimum(path, least + _JUMP)
        np.minimum(best[:, 1:], path[:, :-1] + _STEP, out=best[:, 1:])
        np.minimum(best[:, :-1], path[:, 1:] + _STEP, out=best[:, :-1])
        path = row + best - least
        total[number] += path


def _subpixel(total: Cost, best: npt.NDArray[np.int64]) -> FloatArray:
    """Return the minimum of the parabola through the least cost and its neighbours, less the least's place."""
    inner = np.clip(best, 1, total.shape[2] - 2)
    before, at, after = (np.take_along_axis(total, (inner + k)[..., None], 2)[..., 0] for k in (-1, 0, 1))
    bend = np.maximum(before - 2.0 * at + after, 1e-6)
    return np.where(inner == best, np.clip(0.5 * (before - after) / bend, -0.5, 0.5), 0.0)


def _clear(total: Cost, best: npt.NDArray[np.int64]) -> BoolArray:
    """Return where no other disparity costs about as little."""
    least = np.take_along_axis(total, best[..., None], 2)[..., 0]
    other = total.copy()
    for k in (-1, 0, 1):
        np.put_along_axis(other, np.clip(best + k, 0, total.shape[2] - 1)[..., None], np.inf, 2)
    clear: BoolArray = least < _CLEAR * other.min(axis=2)
    return clear


def _agreed(total: Cost, best: npt.NDArray[np.int64]) -> BoolArray:
    """Return where the right picture's pixel finds its way back."""
    height, width, most = total.shape
    of_right = np.full((height, width, most), np.inf, dtype=np.float32)
    for d in range(most):
        of_right[:, : width - d, d] = total[:, d:, d]
    back = of_right.argmin(axis=2)
    columns = np.arange(width) - best
    agreed: BoolArray = np.abs(np.take_along_axis(back, np.maximum(columns, 0), 1) - best) <= _AGREE_PX
    return agreed & (columns >= 0)
