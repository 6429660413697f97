"""Our own overlaps as the benchmark calls them."""

import functools
import inspect
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.overlap.pairs import Pairs, Solid
from robot_side import overlap
from robot_side.overlap import kernels
from robot_side.overlap.closed_forms.solid import Overlaps

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
    """Volumes, gradients and areas from the kernels that a tick calls, which check nothing, in one thread."""
    result: Overlaps = _KERNELS[pairs.solid](*pairs.arguments, **_one_thread(pairs.solid))
    return result


def kernel_volumes(pairs: Pairs) -> FloatArray:
    """Their volumes alone."""
    return np.asarray(kernel_overlaps(pairs)[0])


@functools.cache
def _options(solid: Solid) -> frozenset[str]:
    """The names of the kernel's parameters."""
    return frozenset(inspect.signature(_KERNELS[solid]).parameters)


def _one_thread(solid: Solid) -> dict[str, Any]:
    """Keeps a kernel that would share out many pairs among threads from doing so."""
    return {"threads": 1} if "threads" in _options(solid) else {}


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


def calls(pairs: Pairs, each: int, *, checked: bool) -> Callable[[], object]:
    """What makes calls of `each` pairs, of the public function with gradients or of the kernel in one thread."""
    function, options = _KERNELS[pairs.solid], _one_thread(pairs.solid)
    if checked:
        function, options = _PUBLIC[pairs.solid], {"gradient": True}
    call = functools.partial(function, **options)
    arguments = [pairs[slice(first, first + each)].arguments for first in range(0, len(pairs), each)]

    def run() -> None:
        for given in arguments:
            call(*given)

    return run


def threaded_volumes(pairs: Pairs, pool: ThreadPoolExecutor, threads: int) -> FloatArray:
    """Volumes from the kernels, which let go of the interpreter's lock, in as many parts as threads."""
    edges = np.linspace(0, len(pairs), threads + 1).astype(int)
    parts = [pairs[slice(start, end)] for start, end in pairwise(edges)]
    return np.concatenate(list(pool.map(kernel_volumes, parts)))


def precise_count(pairs: Pairs) -> int | None:
    """How many pairs took the compensated forms; None where the kernels do not say."""
    counter: Any = getattr(kernels, "PairCounts", None)
    if counter is None or "counts" not in _options(pairs.solid):
        return None
    counts = counter()
    _KERNELS[pairs.solid](*pairs.arguments, counts=counts)
    return int(counts.precise)
