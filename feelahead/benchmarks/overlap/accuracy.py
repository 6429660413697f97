"""Errors against the truth, class by class: ours, and the published package's beside them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from rich.progress import Progress

from common.arrays import BoolArray, FloatArray
from feelahead.benchmarks.overlap.approximations import face_planes
from feelahead.benchmarks.overlap.classes import family
from feelahead.benchmarks.overlap.contact import nearest_points, triangles_of
from feelahead.benchmarks.overlap.ours import kernel_overlaps, precise_count
from feelahead.benchmarks.overlap.pairs import Pairs
from feelahead.benchmarks.overlap.peers import PythonPeer
from feelahead.benchmarks.overlap.truth import Truth, true_overlap
from feelahead.benchmarks.report import Report, Table, short

ROUNDOFF = 2.0**-53
"""Of a double, relative."""


@dataclass(frozen=True)
class Sample:
    """Pairs of one class with their truths."""

    name: str
    pairs: Pairs
    truths: list[Truth]

    @property
    def family(self) -> str:
        """The group that the class is shown with."""
        return family(self.name)

    @property
    def true_volumes(self) -> FloatArray:
        """(p,) in m³, rounded to doubles."""
        return np.array([float(truth.volume) for truth in self.truths])

    def errors(self, volumes: FloatArray) -> FloatArray:
        """(p,): |volume - truth| as a share of the sphere's volume."""
        each = zip(self.truths, volumes.tolist(), strict=True)
        return np.array([truth.volume_error(volume) for truth, volume in each]) / self.pairs.sphere_volumes

    def relative_errors(self, volumes: FloatArray) -> FloatArray:
        """(p,): |volume - truth| / truth; 0 where both are 0, infinite where only the truth is."""
        return np.array(
            [
                float(truth.volume_error(volume) / truth.volume) if truth.volume else (np.inf if volume else 0.0)
                for truth, volume in zip(self.truths, volumes.tolist(), strict=True)
            ]
        )


def draw_samples(classes: dict[str, Pairs], progress: Progress) -> list[Sample]:
    """The truths of every class."""
    bar = progress.add_task("true overlaps", total=sum(len(pairs) for pairs in classes.values()))
    samples = []
    for name, pairs in classes.items():
        truths = []
        for row in range(len(pairs)):
            truths.append(true_overlap(pairs, row))
            progress.advance(bar)
        samples.append(Sample(name, pairs, truths))
    return samples


def measure_accuracy(report: Report, samples: list[Sample], python_peer: PythonPeer) -> None:
    """Add the errors of every class, and a table of them by family."""
    rows: dict[tuple[str, str], list[_ClassErrors]] = {}
    for sample in samples:
        errors = _class_errors(sample, python_peer)
        rows.setdefault((sample.pairs.solid, sample.family), []).append(errors)
        errors.add_to(report, sample)
    table = [_row(solid, shown, errors) for (solid, shown), errors in rows.items()]
    report.tables.append(
        Table(
            "Accuracy, shares of the sphere's volume",
            _COLUMNS,
            table,
            "Errors of the volume against the truth for the doubles as they are; gradient, area: the worst errors"
            " of dV/dcentre and dV/dradius, as shares of the great circle and the sphere's surface. Relative: the"
            " worst error over the true volume, where that is at least 1e-12 of the sphere's. Over floor: the "
            "worst relative error over 2u·scale/depth, what inputs that are rounded to doubles (u = 2^-53) make a"
            " cap of this depth uncertain by. One face, more: pairs whose sphere cuts one face, or more; precise:"
            " pairs that took the compensated forms. Tetrahedra are turned right-handed for the package, except "
            "in the class `inverted`.",
        )
    )


_COLUMNS = (
    *("class", "pairs", "worst", "p99", "median", "gradient", "area", "relative", "over floor"),
    *("trivial %", "one face %", "more %", "precise %", "overlap 0.2.0, worst"),
)


@dataclass(frozen=True)
class _ClassErrors:
    errors: FloatArray
    gradient_errors: FloatArray
    area_errors: FloatArray
    relative: FloatArray
    over_floor: FloatArray
    trivial: BoolArray
    one_face: BoolArray
    precise: int | None
    peer: FloatArray | None

    def add_to(self, report: Report, sample: Sample) -> None:
        solid = sample.pairs.solid
        values = {
            "pairs": (float(len(self.errors)), ""),
            "worst error": (float(self.errors.max()), "of the sphere"),
            "p99 error": (float(np.quantile(self.errors, 0.99)), "of the sphere"),
            "median error": (float(np.median(self.errors)), "of the sphere"),
            "worst gradient error": (float(self.gradient_errors.max()), "of the great circle"),
            "worst area error": (float(self.area_errors.max()), "of the sphere's surface"),
            "worst relative error": (_most(self.relative), ""),
            "worst error over floor": (_most(self.over_floor), ""),
            "trivial": (float(self.trivial.mean()), "share"),
            "one face": (float(self.one_face.mean()), "share"),
        }
        if self.precise is not None:
            values["precise"] = (self.precise / len(self.errors), "share")
        report.add("accuracy", "ours", solid, sample.name, values)
        if self.peer is not None:
            worst = {"worst error": (float(self.peer.max()), "of the sphere")}
            report.add("accuracy", "overlap, Python", solid, sample.name, worst)


def _class_errors(sample: Sample, python_peer: PythonPeer) -> _ClassErrors:
    pairs = sample.pairs
    volumes, gradients, areas = kernel_overlaps(pairs)
    circles = np.pi * pairs.radii**2
    relative = sample.relative_errors(volumes)
    shares = sample.true_volumes / pairs.sphere_volumes
    peer = None
    if not python_peer.missing and pairs.solid in ("tetrahedron", "box"):
        peer = sample.errors(python_peer.volumes(pairs, mend="inverted" not in sample.name)[0])
    touched = shares > 0.0
    return _ClassErrors(
        sample.errors(volumes),
        np.array([truth.gradient_error(g) for truth, g in zip(sample.truths, gradients, strict=True)]) / circles,
        np.array([truth.area_error(a) for truth, a in zip(sample.truths, areas.tolist(), strict=True)])
        / (4.0 * circles),
        relative[shares >= 1e-12],
        relative[touched] / _floors(pairs)[touched],
        _trivial(sample),
        np.array([truth.faces_cut == 1 for truth in sample.truths]),
        precise_count(pairs),
        peer,
    )


def _trivial(sample: Sample) -> BoolArray:
    """(p,): whether one lies within the other or nothing is shared."""
    found = []
    for truth, radius in zip(sample.truths, sample.pairs.radii.tolist(), strict=True):
        swallowed = abs(truth.area) <= 1e-25 * radius**2
        found.append(bool(truth.volume == 0 or truth.faces_cut == 0 or swallowed))
    return np.array(found)


def depths(pairs: Pairs) -> FloatArray:
    """(p,) in m: how far the sphere reaches into the solid, along the shortest way out."""
    if pairs.solid == "half-space":
        normals, offsets = pairs.parameters
        lengths = np.linalg.norm(normals, axis=1)
        return np.asarray(pairs.radii - (np.einsum("ni,ni->n", normals, pairs.centers) - offsets) / lengths)
    if pairs.solid == "sphere":
        others, other_radii = pairs.parameters
        return np.asarray(pairs.radii + other_radii - np.linalg.norm(others - pairs.centers, axis=1))
    nearest = nearest_points(pairs.corners - pairs.centers[:, None], triangles_of(pairs))
    inside = (face_planes(pairs)[1] > 0.0).all(axis=1)
    return np.asarray(pairs.radii - np.where(inside, -1.0, 1.0) * np.linalg.norm(nearest, axis=1))


def _floors(pairs: Pairs) -> FloatArray:
    """(p,): the relative error that rounding the inputs alone makes for a cap of the pair's depth."""
    rounding = ROUNDOFF * pairs.scales
    return np.asarray(2.0 * rounding / np.clip(depths(pairs), rounding, pairs.radii))


def _row(solid: str, shown: str, classes: list[_ClassErrors]) -> tuple[str, ...]:
    errors = np.concatenate([one.errors for one in classes])
    trivial = np.concatenate([one.trivial for one in classes])
    one_face = np.concatenate([one.one_face for one in classes]) & ~trivial
    peers = [one.peer for one in classes if one.peer is not None]
    precise = [one.precise for one in classes if one.precise is not None]
    return (
        f"{solid}, {shown}",
        str(len(errors)),
        short(float(errors.max())),
        short(float(np.quantile(errors, 0.99))),
        short(float(np.median(errors))),
        _worst(classes, lambda one: one.gradient_errors),
        _worst(classes, lambda one: one.area_errors),
        _worst(classes, lambda one: one.relative),
        _worst(classes, lambda one: one.over_floor),
        _percent(trivial.mean()),
        _percent(one_face.mean()),
        _percent(np.mean(~trivial & ~one_face)),
        _percent(sum(precise) / len(errors)) if precise else "-",
        short(float(np.concatenate(peers).max())) if peers else "-",
    )


def _worst(classes: list[_ClassErrors], of: Callable[[_ClassErrors], FloatArray]) -> str:
    values = np.concatenate([of(one) for one in classes])
    return short(_most(values)) if len(values) else "-"


def _most(values: FloatArray) -> float:
    return float(values.max()) if len(values) else 0.0


def _percent(share: float | np.floating) -> str:
    return f"{100.0 * float(share):.0f}"
