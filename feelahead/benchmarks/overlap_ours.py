"""Our own overlaps as the benchmark calls them."""

import inspect
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.overlap_pairs import Pairs, Solid
from robot_side import overlap
from robot_side.overlap import kernels
from robot_side.overlap.kernels import Overlaps

_PUBLIC: dict[Solid, Callable[..., Any]] = {
    "tetrahedron": overlap.sphere_tetrahedron,
    "box": overlap.sphere_box,
    "half-space": overlap.sphere_half_space,
    "sphere": overlap.sphere_sphere,
}
_KERNELS: dict[Solid, Callable[..., Any]] = {
    "tetrahedron": kernels.tetrahedron_pairs,
    "box": kernels.box_pairs,
    "half-space": kernels.half_space_pairs,
    "sphere": kernels.sphere_pairs,
}


def kernel_overlaps(pairs: Pairs) -> Overlaps:
    """Volumes, gradients and areas from the kernels that a tick calls, which check nothing."""
    result: Overlaps = _KERNELS[pairs.solid](*pairs.arguments)
    return result


def kernel_volumes(pairs: Pairs) -> FloatArray:
    """Volumes alone, where the kernels can leave out the rest; else with all of it."""
    kernel = _KERNELS[pairs.solid]
    if volumes_apart(pairs.solid):
        return np.asarray(kernel(*pairs.arguments, gradient=False)[0])
    return np.asarray(kernel(*pairs.arguments)[0])


def volumes_apart(solid: Solid) -> bool:
    """Whether the kernel can leave out gradients and areas."""
    return "gradient" in inspect.signature(_KERNELS[solid]).parameters


def checked_volumes(pairs: Pairs) -> FloatArray:
    """Volumes from the public function, in one call."""
    return np.asarray(_PUBLIC[pairs.solid](*pairs.arguments))


def checked_overlaps(pairs: Pairs) -> Overlaps:
    """Volumes, gradients and areas from the public function, in one call."""
    result: Overlaps = _PUBLIC[pairs.solid](*pairs.arguments, gradient=True)
    return result


def call_by_call(pairs: Pairs) -> FloatArray:
    """Volumes from the public function, in a call for each pair."""
    function = _PUBLIC[pairs.solid]
    return np.array([function(*arguments) for arguments in zip(*pairs.arguments, strict=True)])


def threaded_volumes(pairs: Pairs, pool: ThreadPoolExecutor, threads: int) -> FloatArray:
    """Volumes from the kernels, which let go of the interpreter's lock, in as many parts as threads."""
    edges = np.linspace(0, len(pairs), threads + 1).astype(int)
    parts = [pairs[slice(start, end)] for start, end in pairwise(edges)]
    return np.concatenate(list(pool.map(kernel_volumes, parts)))


def precise_count(pairs: Pairs) -> int | None:
    """How many pairs took the compensated forms; None where the kernels do not say."""
    counter: Any = getattr(kernels, "PairCounts", None)
    if counter is None or "counts" not in inspect.signature(_KERNELS[pairs.solid]).parameters:
        return None
    counts = counter()
    _KERNELS[pairs.solid](*pairs.arguments, counts=counts)
    return int(counts.precise)
