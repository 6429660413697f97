"""Errors of computed overlaps against the truth, and counts of impossible results."""

from dataclasses import dataclass

import numpy as np

from common.arrays import BoolArray, FloatArray
from feelahead.lab.reference.classes import MAKERS
from feelahead.lab.reference.contact import contacts
from feelahead.lab.reference.oracle import Truth, true_overlap
from feelahead.lab.reference.pairs import Pairs
from robot_side.overlap import kernels

Overlaps = tuple[FloatArray, FloatArray, FloatArray]

LEAST_SHARE = 1e-12
"""Smallest overlap, as a share of the sphere, whose relative error has a limit, unless a class is made shallower."""
_SLOPE = 1e-2
_EXAMINED = 5
"""About how many false zeros of a class get their true volumes computed."""


@dataclass(frozen=True)
class Errors:
    """Errors of each pair (p,), as shares of the sphere's volume, great circle and surface."""

    volume: FloatArray
    gradient: FloatArray
    area: FloatArray
    relative: FloatArray
    """Error of the volume, divided by the true volume; 0 where both are 0, infinite where only the true volume is 0."""
    direction: FloatArray
    """Error of the gradient's direction in radians; taken only where the ball just reaches into the solid, else 0."""
    shares: FloatArray
    """True volume as a share of the sphere's."""


def compare(pairs: Pairs, truths: list[Truth], overlaps: Overlaps) -> Errors:
    """Compare the overlaps of all pairs with their truths."""
    volumes, gradients, areas = overlaps
    circles = np.pi * pairs.radii**2
    shares = np.array([float(truth.volume) for truth in truths]) / pairs.sphere_volumes
    slopes = np.array([np.linalg.norm([float(part) for part in truth.gradient]) for truth in truths])
    # A swallowed solid has no direction; where a ball just reaches in, |∇V| is far above V/R.
    reaches_in = (shares >= LEAST_SHARE) & (shares <= _SLOPE) & (slopes > shares * pairs.sphere_volumes / pairs.radii)
    direction = [truth.direction_error(gradient) for truth, gradient in zip(truths, gradients, strict=True)]
    return Errors(
        volume=volume_errors(pairs, truths, volumes),
        gradient=np.array([t.gradient_error(g) for t, g in zip(truths, gradients, strict=True)]) / circles,
        area=np.array([t.area_error(a) for t, a in zip(truths, areas.tolist(), strict=True)]) / (4.0 * circles),
        relative=relative_errors(truths, volumes),
        direction=np.where(reaches_in, direction, 0.0),
        shares=shares,
    )


def volume_errors(pairs: Pairs, truths: list[Truth], volumes: FloatArray) -> FloatArray:
    """Return |volume - truth| (p,) as shares of the sphere's volume, infinite for NaN."""
    each = [truth.volume_error(volume) for truth, volume in zip(truths, volumes.tolist(), strict=True)]
    return np.array(each) / pairs.sphere_volumes


def relative_errors(truths: list[Truth], volumes: FloatArray) -> FloatArray:
    """Return |volume - truth| / truth (p,)."""
    return np.array(
        [
            float(truth.volume_error(volume) / truth.volume) if truth.volume else (np.inf if volume else 0.0)
            for truth, volume in zip(truths, volumes.tolist(), strict=True)
        ]
    )


def kernel_overlaps(pairs: Pairs) -> Overlaps:
    """Return volumes, gradients and areas by the unchecked kernels that a tick uses."""
    if pairs.solid == "tetrahedron":
        return kernels.tetrahedron_pairs(*pairs.arguments)
    if pairs.solid == "box":
        return kernels.box_pairs(*pairs.arguments)
    return (kernels.half_space_pairs if pairs.solid == "half-space" else kernels.sphere_pairs)(*pairs.arguments)


def kernel_volumes(pairs: Pairs) -> FloatArray:
    """Return the kernels' volumes; NaN for pairs with which a kernel raises an exception."""
    try:
        return kernel_overlaps(pairs)[0]
    except (ArithmeticError, ValueError, RuntimeError):
        if len(pairs) == 1:
            return np.full(1, np.nan)
        return np.concatenate([kernel_volumes(pairs[slice(row, row + 1)]) for row in range(len(pairs))])


def partial_pairs(solid: str, count: int, seed: int) -> Pairs:
    """Draw random pairs that overlap in part: neither is apart from the other or contains the other."""
    pairs = MAKERS[solid]["random"](np.random.default_rng(seed), 4 * count + 100, False)
    most, volumes = np.minimum(pairs.sphere_volumes, pairs.solid_volumes), kernel_volumes(pairs)
    return pairs[np.flatnonzero((volumes > 1e-6 * most) & (volumes < (1.0 - 1e-6) * most))[:count]]


@dataclass(frozen=True)
class Failures:
    """Counts over all pairs of one class; sizes are shares of the sphere's volume."""

    pairs: int
    undefined: int
    """Number of pairs that gave NaN or raised an exception"""
    negative: int
    false_zeros: int
    largest_missed: float
    """Largest true overlap among the examined false zeros"""
    false_positives: int
    largest_false_positive: float
    excess: float
    """Largest amount by which a volume exceeds the smaller volume of sphere and solid"""


def count_failures(pairs: Pairs, volumes: FloatArray, touching: BoolArray | None = None) -> Failures:
    """Count the failures. touching (p,): whether each pair overlaps; if None, this is decided exactly."""
    touching = contacts(pairs) if touching is None else touching
    spheres = np.where(pairs.sphere_volumes > 0.0, pairs.sphere_volumes, 1.0)
    missed, false = touching & (volumes == 0.0), ~touching & (volumes > 0.0)
    some = np.flatnonzero(missed)[:: max(1, int(missed.sum()) // _EXAMINED)]
    known = ~np.isnan(volumes)
    most = np.minimum(pairs.sphere_volumes, pairs.solid_volumes)
    return Failures(
        pairs=len(pairs),
        undefined=int((~known).sum()),
        negative=int((volumes < 0.0).sum()),
        false_zeros=int(missed.sum()),
        largest_missed=_most(np.array([float(true_overlap(pairs, int(row)).volume) / spheres[row] for row in some])),
        false_positives=int(false.sum()),
        largest_false_positive=_most((volumes / spheres)[false]),
        excess=_most(((volumes - most) / spheres)[known]),
    )


def asymmetry(pairs: Pairs, volumes: FloatArray) -> float:
    """Return the largest change of our volumes between descriptions of a pair, as a share of the sphere's volume."""
    return max(
        (_most(np.abs(kernel_volumes(other) - volumes) / pairs.sphere_volumes) for other in relabelled(pairs)),
        default=0.0,
    )


def shrinking(pairs: Pairs, volumes: FloatArray) -> float:
    """Return the largest decrease of our volumes as the radius grows: by its last digit, 1e-15, 1e-9 or 1e-3 of it."""
    worst = 0.0
    for radii in (np.nextafter(pairs.radii, np.inf), *(pairs.radii * (1.0 + step) for step in (1e-15, 1e-9, 1e-3))):
        grown = kernel_volumes(Pairs(pairs.solid, pairs.centers, radii, pairs.parameters))
        worst = max(worst, _most((volumes - grown) / pairs.sphere_volumes))
    return worst


def relabelled(pairs: Pairs) -> list[Pairs]:
    """Return the same pairs in other descriptions: vertices in another order, a box's axes permuted or reversed."""
    if pairs.solid == "tetrahedron":
        orders = ([1, 0, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1], [1, 2, 3, 0])
        return [Pairs(pairs.solid, pairs.centers, pairs.radii, (pairs.parameters[0][:, order],)) for order in orders]
    if pairs.solid != "box":
        return []
    centers, rotations, half_sizes = pairs.parameters
    axes = (([1, 2, 0], (1.0, 1.0, 1.0)), ([0, 2, 1], (1.0, -1.0, 1.0)), ([0, 1, 2], (-1.0, -1.0, 1.0)))
    return [
        Pairs(
            pairs.solid,
            pairs.centers,
            pairs.radii,
            (centers, rotations[:, :, order] * np.array(signs), half_sizes[:, order]),
        )
        for order, signs in axes
    ]


def _most(values: FloatArray) -> float:
    return max(0.0, float(values.max())) if len(values) else 0.0
