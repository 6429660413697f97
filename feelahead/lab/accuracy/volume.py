"""Overlap of a sphere with a box or tetrahedron: ours, with precise forms and without, and other methods."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from feelahead.lab.accuracy.points import Part, point
from feelahead.lab.interleaved import processor_us
from feelahead.lab.reference import errors
from feelahead.lab.reference.approximations import monte_carlo, voxels
from feelahead.lab.reference.classes import frozen_class
from feelahead.lab.reference.oracle import true_overlaps
from feelahead.lab.reference.pairs import Pairs
from feelahead.lab.reference.published import CompiledHeader
from feelahead.lab.table import Row
from robot_side.overlap.box_batch import overlap_boxes
from robot_side.overlap.tetrahedron_batch import overlap_tetrahedra

CLASSES: Final = {
    "random": "random",
    "face": "centre on face",
    "edge": "centre on edge",
    "corner": "centre on vertex",
    "tangent": "tangent vertex",
    "shallow edge": "edge depth 1e-3",
    "R/L 100": "R/L 1e2",
}
"""Classes of pairs: names here, and in `reference/classes.py`"""
TINY: Final = ("shallow edge", "R/L 100")
"""Classes whose overlaps are so small that their errors are judged as shares of the overlap, too"""
SPHERE: Final = "of the sphere"
OVERLAP: Final = "of the overlap"
HEADER: Final = "overlap, C++"
_SPHERE_MM: Final = 10.0
"""Radius that a voxel's edge in mm is a share of: about that of the gripper's spheres, inflated"""
_Volumes = Callable[[Pairs], FloatArray]
_BATCH: Final = 4096
_FEW: Final = 4
"""Number of pairs that slow methods get"""


def without_precise(pairs: Pairs) -> FloatArray:
    """Return our volumes (p,) as they are before the precise forms correct the doubtful ones."""
    total = len(pairs)
    found = np.zeros(total), np.zeros((total, 3)), np.zeros(total)
    lanes = overlap_boxes if pairs.solid == "box" else overlap_tetrahedra
    lanes(*pairs.arguments, *found, np.empty(total + 1, dtype=np.int64))
    return found[0]


def peers(case: str) -> dict[tuple[str, str], _Volumes]:
    """Return the approximations by knob and setting: all for random pairs, and one of each for the others."""
    points, edges_mm = ((3, 4, 5, 6), (1, 2, 5, 10)) if case == "random" else ((4,), (2,))
    sampled = {("Monte Carlo", f"1e{power} points"): partial(monte_carlo, points=10**power) for power in points}
    cells = {("voxels", f"{mm} mm of R = 10 mm"): partial(voxels, edge=mm / _SPHERE_MM) for mm in edges_mm}
    return {**sampled, **cells}


def measure(solid: str, case: str, count: int, rounds: int, header: CompiledHeader, seed: int) -> Iterator[Row]:
    """Measure one class of pairs of spheres with one kind of solid; all methods take turns."""
    _, pairs = frozen_class(solid, CLASSES[case], count, seed=seed)
    truths = true_overlaps(pairs)
    many: Pairs = pairs[np.resize(np.arange(count), _BATCH)]
    cut: IntArray = np.flatnonzero([truth.faces_cut > 0 for truth in truths])
    few: IntArray = (cut if len(cut) else np.arange(count))[:_FEW]
    others = peers(case)
    all_rows: IntArray = np.arange(count)
    volumes: dict[tuple[str, str], tuple[_Volumes, IntArray]] = {
        ("precise forms", "on"): (errors.kernel_volumes, all_rows),
        ("precise forms", "off"): (without_precise, all_rows),
        **{key: (method, few) for key, method in others.items()},
    }
    works = {key: partial(method, many if key not in others else pairs[few]) for key, (method, _) in volumes.items()}
    found: dict[tuple[str, str], tuple[FloatArray, IntArray]] = {
        key: (method(pairs[rows]), rows) for key, (method, rows) in volumes.items()
    }
    times_us = processor_us(works, rounds)
    us = {key: times_us[key] / (len(few) if key in others else _BATCH) for key in works}
    if not header.missing:
        key = HEADER, "0.2.0, volume alone"
        parts_ns, theirs = header.timed(many)
        found[key], us[key] = (theirs[:count], all_rows), 1e-3 * float(parts_ns.sum()) / _BATCH
    for key, (own, rows) in found.items():
        some = [truths[row] for row in rows]
        kinds = {SPHERE: np.minimum(errors.volume_errors(pairs[rows], some, own), 1.0)}
        if case in TINY:
            kinds[OVERLAP] = np.minimum(errors.relative_errors(some, own), 1.0)
        for unit, wrong in kinds.items():
            mine, built = key[0] == "precise forms", key == ("precise forms", "on")
            yield point(Part(f"volume, {case}", unit, "30 digits"), *key, us[key], wrong, ours=mine, built=built)
