"""Checks that triangles are the surface of a solid: closed, oriented outward, and without overlapping parts."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from common.arrays import FloatArray, IntArray
from robot_side.overlap.checks.arguments import numbers

_FLAT = 1e-14
"""Volume of a part, as a share of the cube of its size, up to which it counts as flat and has no orientation"""
_SAMPLES = 8
_CERTAIN = 0.1


def checked_vertices(vertices: npt.ArrayLike) -> FloatArray:
    """Return `vertices` as finite float64 numbers (v, 3), or raise a ValueError."""
    values = numbers("vertices", vertices, (3,)).values
    if values.ndim != 2:
        raise ValueError(f"vertices has the shape {values.shape}; valid: the shape (v, 3)")
    return values


def checked_triangles(triangles: npt.ArrayLike, vertex_count: int) -> IntArray:
    """Return `triangles` as int64 (t, 3) of indices below `vertex_count`, or raise a ValueError."""
    try:
        raw = np.asarray(triangles)
    except ValueError as error:
        raise ValueError("triangles is no rectangular array; valid: the shape (t, 3)") from error
    if raw.ndim != 2 or raw.shape[1] != 3 or len(raw) == 0:
        raise ValueError(f"triangles has the shape {raw.shape}; valid: the shape (t, 3), t > 0")
    if raw.dtype.kind not in "iu":
        raise ValueError(f"triangles has the type {raw.dtype}; valid: integers, indices of vertices")
    if vertex_count == 0:
        raise ValueError("vertices is empty; valid: four vertices or more")
    wrong = np.argwhere((raw < 0) | (raw >= vertex_count))
    if len(wrong):
        row = int(wrong[0, 0])
        raise ValueError(f"triangles[{row}] = {raw[row].tolist()} is out of range; valid: 0 to {vertex_count - 1}")
    return raw.astype(np.int64)


def merged(vertices: FloatArray, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Return (triangles (k, 3) in which equal vertices are merged into one, these triangles' numbers (k,) as given).

    A triangle that has a corner twice is left out, because it bounds nothing.
    """
    # Adding 0 makes -0 equal to 0.
    _, first, inverse = np.unique(vertices + 0.0, axis=0, return_index=True, return_inverse=True)
    same = first[inverse.ravel()][triangles]
    kept = (same[:, 0] != same[:, 1]) & (same[:, 1] != same[:, 2]) & (same[:, 2] != same[:, 0])
    return np.asarray(same[kept], dtype=np.int64), np.flatnonzero(kept)


def require_closed(triangles: IntArray, numbers_given: IntArray) -> None:
    """Raise a ValueError that names the first edge that is not used equally often in both directions."""
    starts, ends = triangles, np.roll(triangles, -1, axis=1)
    keys = _edge_keys(starts, ends)
    _, place = np.unique(keys, return_inverse=True)
    balance = np.bincount(place, weights=np.where(starts < ends, 1.0, -1.0).ravel())
    open_edges = np.flatnonzero(balance[place] != 0.0)
    if len(open_edges) == 0:
        return
    row, corner = divmod(int(open_edges[0]), 3)
    start, end = int(starts[row, corner]), int(ends[row, corner])
    forward = int(np.count_nonzero((starts == start) & (ends == end)))
    backward = int(np.count_nonzero((starts == end) & (ends == start)))
    raise ValueError(
        f"triangles[{numbers_given[row]}]: its edge from vertex {start} to {end} is used {forward} times in this "
        f"direction and {backward} times in the other; valid: a closed surface, equally often in both"
    )


def components(triangles: IntArray) -> IntArray:
    """Return for each triangle the number of its part (t,); the triangles of a part are connected by edges."""
    keys = _edge_keys(triangles, np.roll(triangles, -1, axis=1))
    _, place = np.unique(keys, return_inverse=True)
    count = len(triangles)
    rows = np.repeat(np.arange(count), 3)
    graph = coo_array((np.ones(3 * count), (rows, count + place)), shape=(count + place.max() + 1,) * 2)
    labels = connected_components(graph, directed=False)[1][:count]
    return np.asarray(np.unique(labels, return_inverse=True)[1], dtype=np.int64)


def require_all_different(triangles: IntArray, numbers_given: IntArray) -> None:
    """Raise a ValueError that names the first triangle given twice the same way round: the solid overlaps itself."""
    first = triangles.argmin(axis=1)
    rows = np.arange(len(triangles))
    turned = np.column_stack([triangles[rows, (first + corner) % 3] for corner in range(3)])
    _, place, count = np.unique(turned, axis=0, return_inverse=True, return_counts=True)
    place = place.ravel()
    repeated = np.flatnonzero(count[place] > 1)
    if len(repeated) == 0:
        return
    one, other = np.flatnonzero(place == place[repeated[0]])[:2]
    raise ValueError(
        f"triangles[{numbers_given[other]}] is triangles[{numbers_given[one]}] again, the same way round; "
        "valid: each triangle once"
    )


def signed_volume(corners: FloatArray) -> float:
    """Return the volume (m³) within a closed surface `corners` (t, 3, 3), negative if it is oriented inward."""
    # In extended precision if the machine has it: the terms of a thin plate cancel.
    a, b, c = np.moveaxis((corners - corners.reshape(-1, 3).mean(axis=0)).astype(np.longdouble), 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6.0)


def require_outward(corners: FloatArray, parts: IntArray, numbers_given: IntArray) -> None:
    """Raise a ValueError unless each part is oriented outward, or inward within another part."""
    order = np.argsort(parts, kind="stable")
    ends = np.cumsum(np.bincount(parts))
    members = np.split(order, ends[:-1])
    if len(members) == 1:
        boxes = np.empty((0, 2, 3))
    else:
        starts = ends - np.bincount(parts)
        lowest = np.minimum.reduceat(corners.min(axis=1)[order], starts)
        highest = np.maximum.reduceat(corners.max(axis=1)[order], starts)
        boxes = np.stack([lowest, highest], axis=1)
    for part, own in enumerate(members):
        volume, size = signed_volume(corners[own]), float(np.ptp(corners[own].reshape(-1, 3), axis=0).max())
        if abs(volume) <= _FLAT * size**3:
            continue
        first = int(numbers_given[own[0]])
        around = _winding_around(corners, members, boxes, part)
        if volume < 0.0 and around in (0, None):
            raise ValueError(
                f"triangles[{first}] and those connected with it enclose {volume:.3g} m³; valid: a volume above 0, "
                "corners anticlockwise as seen from outside (clockwise only round a cavity)"
            )
        if volume > 0.0 and around not in (0, None):
            raise ValueError(
                f"triangles[{first}] and those connected with it lie within another part of the mesh; "
                "valid: parts that do not overlap"
            )


def _winding_around(corners: FloatArray, members: Sequence[IntArray], boxes: FloatArray, part: int) -> int | None:
    """Return the winding number of all other parts about the part `part`: 0 if it lies within none.

    Return None if it touches them at all sampled points, so that the number is undecided.
    """
    if len(members) == 1:
        return 0
    candidates = corners[members[part]].mean(axis=1)
    points = candidates[np.linspace(0, len(candidates) - 1, _SAMPLES).astype(int)]
    winding = np.zeros(len(points))
    for row, point in enumerate(points):
        # A part has winding number 0 about points outside its box.
        near = np.flatnonzero((boxes[:, 0] <= point).all(axis=1) & (point <= boxes[:, 1]).all(axis=1))
        others = [members[other] for other in near.tolist() if other != part]
        if others:
            winding[row] = _winding(corners[np.concatenate(others)], point)
    off = np.abs(winding - np.round(winding))
    best = int(off.argmin())
    return round(float(winding[best])) if off[best] < _CERTAIN else None


def _winding(corners: FloatArray, point: FloatArray) -> float:
    """Return the winding number of triangles (t, 3, 3) about `point`.

    It is the sum of their solid angles (van Oosterom and Strackee, 1983), divided by 4π.
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    length_a, length_b, length_c = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    cosine = length_a * length_b * length_c + np.sum(a * b, axis=1) * length_c
    cosine += np.sum(b * c, axis=1) * length_a + np.sum(c * a, axis=1) * length_b
    return float(np.sum(np.arctan2(np.sum(a * np.cross(b, c), axis=1), cosine)) / (2.0 * np.pi))


def _edge_keys(starts: IntArray, ends: IntArray) -> IntArray:
    """Return a number for each triangle's edges (3 t,), the same for an edge and its reverse."""
    count = int(starts.max()) + 1
    return np.asarray((np.minimum(starts, ends) * count + np.maximum(starts, ends)).ravel(), dtype=np.int64)
