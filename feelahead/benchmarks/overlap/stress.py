"""Hard counts over many adversarial pairs: what must not happen even once."""

from dataclasses import dataclass, field, fields

import numpy as np
from rich.progress import Progress

from common.arrays import BoolArray, FloatArray
from feelahead.benchmarks.overlap.accuracy import Sample
from feelahead.benchmarks.overlap.contact import contacts
from feelahead.benchmarks.overlap.ours import checked_volumes, kernel_overlaps, precise_count
from feelahead.benchmarks.overlap.pairs import Pairs, Solid
from feelahead.benchmarks.overlap.peers import PythonPeer
from feelahead.benchmarks.overlap.truth import true_overlap
from feelahead.benchmarks.report import Report, Table, short

LARGE_ERROR = 1e-6
"""Of the sphere's volume."""
_EXAMINED = 300
"""False zeros whose true volume is worked out."""


@dataclass
class Counts:
    """What happened over all pairs; shares are of the sphere's volume."""

    pairs: int = 0
    exceptions: int = 0
    nan: int = 0
    negative: int = 0
    precise: int = 0
    false_zeros: int = 0
    largest_missed: float = 0.0
    false_positives: int = 0
    largest_false_positive: float = 0.0
    excess: float = 0.0
    asymmetry: float = 0.0
    shrinking: float = 0.0
    missed: list[tuple[Pairs, int]] = field(default_factory=list)

    def add(self, pairs: Pairs, volumes: FloatArray, touching: BoolArray) -> None:
        """Count these volumes (p,), NaN included, given whether the pairs overlap."""
        spheres = np.where(pairs.sphere_volumes > 0.0, pairs.sphere_volumes, 1.0)
        self.pairs += len(pairs)
        self.nan += int(np.isnan(volumes).sum())
        self.negative += int((volumes < 0.0).sum())
        zero = touching & (volumes == 0.0)
        self.false_zeros += int(zero.sum())
        self.missed += [(pairs, int(row)) for row in np.flatnonzero(zero)]
        false = ~touching & (volumes > 0.0)
        self.false_positives += int(false.sum())
        self.largest_false_positive = max(self.largest_false_positive, _most((volumes / spheres)[false]))
        most = np.minimum(pairs.sphere_volumes, pairs.solid_volumes)
        self.excess = max(self.excess, _most(((volumes - most) / spheres)[~np.isnan(volumes)]))

    def examine_missed(self, progress: Progress) -> None:
        """Work out the true volumes of false zeros, of up to a few hundred spread over all of them."""
        chosen = self.missed[:: -(-len(self.missed) // _EXAMINED) or 1]
        bar = progress.add_task("false zeros", total=len(chosen))
        for pairs, row in chosen:
            share = float(true_overlap(pairs, row).volume) / float(pairs.sphere_volumes[row])
            self.largest_missed = max(self.largest_missed, share)
            progress.advance(bar)

    def figures(self) -> dict[str, tuple[float, str]]:
        """Every count and share by its name."""
        values = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "missed"}
        return {name: (float(value), "") for name, value in values.items()}


def count_failures(
    report: Report,
    classes: dict[str, Pairs],
    samples: list[Sample],
    python_peer: PythonPeer,
    progress: Progress,
) -> tuple[Counts, Counts | None]:
    """Ours over every pair, the package's over every tetrahedron and box; errors over the pairs with a truth."""
    bar = progress.add_task("adversarial pairs", total=sum(len(pairs) for pairs in classes.values()))
    ours, peer = Counts(), None if python_peer.missing else Counts()
    for name, pairs in classes.items():
        touching = contacts(pairs)
        volumes, exceptions = our_volumes(pairs)
        ours.exceptions += exceptions
        ours.add(pairs, volumes, touching)
        ours.precise += precise_count(pairs) or 0
        ours.asymmetry = max(ours.asymmetry, asymmetry(pairs, volumes))
        ours.shrinking = max(ours.shrinking, shrinking(pairs, volumes))
        if peer is not None and pairs.solid in ("tetrahedron", "box"):
            volumes, exceptions = python_peer.volumes(pairs, mend="inverted" not in name)
            peer.exceptions += exceptions
            # What it refuses with an exception is counted there, and not as NaN again.
            peer.add(pairs, volumes, touching)
            peer.nan -= exceptions
        progress.advance(bar, len(pairs))
    for counts in (ours, peer):
        if counts is not None:
            counts.examine_missed(progress)
    _report_counts(report, ours, peer, samples, python_peer)
    return ours, peer


def our_volumes(pairs: Pairs) -> tuple[FloatArray, int]:
    """(Volumes (p,), how many pairs raised an exception, which are then NaN)."""
    try:
        return kernel_overlaps(pairs)[0], 0
    except (ArithmeticError, ValueError, RuntimeError):
        pass
    volumes, exceptions = np.full(len(pairs), np.nan), 0
    for row in range(len(pairs)):
        try:
            volumes[row] = kernel_overlaps(pairs[slice(row, row + 1)])[0][0]
        except (ArithmeticError, ValueError, RuntimeError):
            exceptions += 1
    return volumes, exceptions


def relabelled(pairs: Pairs) -> list[Pairs]:
    """The same sets in other words: vertices in another order, a box's axes permuted and turned round."""
    if pairs.solid == "tetrahedron":
        orders = ([1, 0, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1], [1, 2, 3, 0])
        return [
            Pairs("tetrahedron", pairs.centers, pairs.radii, (np.ascontiguousarray(pairs.parameters[0][:, order]),))
            for order in orders
        ]
    if pairs.solid == "box":
        centers, rotations, half_sizes = pairs.parameters
        found = []
        for order, signs in (
            ([1, 2, 0], (1.0, 1.0, 1.0)),
            ([0, 2, 1], (1.0, -1.0, 1.0)),
            ([0, 1, 2], (-1.0, -1.0, 1.0)),
        ):
            turned = np.ascontiguousarray(rotations[:, :, order] * np.array(signs))
            found.append(
                Pairs("box", pairs.centers, pairs.radii, (centers, turned, np.ascontiguousarray(half_sizes[:, order])))
            )
        return found
    return []


def asymmetry(pairs: Pairs, volumes: FloatArray) -> float:
    """The largest difference under relabelling, as a share of the sphere's volume."""
    return max(
        (_most(np.abs(our_volumes(other)[0] - volumes) / pairs.sphere_volumes) for other in relabelled(pairs)),
        default=0.0,
    )


def shrinking(pairs: Pairs, volumes: FloatArray) -> float:
    """The largest loss of volume as the radius grows by a last digit, 1e-15, 1e-9 or 1e-3 of itself."""
    worst = 0.0
    for radii in (np.nextafter(pairs.radii, np.inf), *(pairs.radii * (1.0 + step) for step in (1e-15, 1e-9, 1e-3))):
        grown = our_volumes(Pairs(pairs.solid, pairs.centers, radii, pairs.parameters))[0]
        worst = max(worst, _most((volumes - grown) / pairs.sphere_volumes))
    return worst


def silent_nan(count: int, seed: int) -> int:
    """How many of `count` pairs with a NaN or an infinity somewhere the public functions let pass."""
    rng = np.random.default_rng(seed)
    passed = 0
    for number in range(count):
        solid, sizes = _SHAPES[number % len(_SHAPES)]
        arguments = [np.ones(size) for size in sizes]
        if solid == "box":
            arguments[3] = np.eye(3)[None]
        spoilt = arguments[rng.integers(len(arguments))].reshape(-1)
        spoilt[rng.integers(len(spoilt))] = rng.choice((np.nan, np.inf, -np.inf))
        try:
            checked_volumes(Pairs(solid, arguments[0], arguments[1], tuple(arguments[2:])))
        except ValueError:
            continue
        passed += 1
    return passed


_SHAPES: tuple[tuple[Solid, tuple[tuple[int, ...], ...]], ...] = (
    ("tetrahedron", ((1, 3), (1,), (1, 4, 3))),
    ("box", ((1, 3), (1,), (1, 3), (1, 3, 3), (1, 3))),
    ("half-space", ((1, 3), (1,), (1, 3), (1,))),
    ("sphere", ((1, 3), (1,), (1, 3), (1,))),
)


def _report_counts(
    report: Report, ours: Counts, peer: Counts | None, samples: list[Sample], python_peer: PythonPeer
) -> None:
    for method, counts in (("ours", ours), ("overlap, Python", peer)):
        if counts is not None:
            report.add("stress", method, "all", "adversarial", counts.figures())
    large = {}
    for method in ("ours", "overlap, Python") if peer is not None else ("ours",):
        large[method] = _large_errors(samples, None if method == "ours" else python_peer)
        report.add("stress", method, "all", "with truth", {"large errors": (float(large[method]), "")})
    silent = silent_nan(1000, 0)
    report.add("stress", "ours", "all", "NaN and infinity", {"silent": (float(silent), "")})
    rows = [
        ("pairs", str(ours.pairs), "" if peer is None else str(peer.pairs)),
        *(
            (text, short(float(getattr(ours, name))), "" if peer is None else short(float(getattr(peer, name))))
            for name, text in _SHOWN.items()
        ),
        *((text, short(float(getattr(ours, name))), "") for name, text in _SHOWN_OF_OURS.items()),
        (
            f"errors above 1e-6 of the sphere, of {sum(len(s.pairs) for s in samples)} pairs with a truth",
            *(str(large[method]) for method in large),
        ),
        ("NaN or infinity let pass by the checked functions, of 1000", str(silent), ""),
    ]
    report.tables.append(
        Table(
            "Adversarial pairs",
            ("count", "ours", "overlap 0.2.0"),
            [row if len(row) == 3 else (*row, "") for row in rows],
            "Whether a pair overlaps at all is decided exactly, in whole numbers. The package is given the tetrahedra "
            "and boxes only. Of those returned as zero, the true volumes of a few hundred, spread over all, are worked "
            "out.",
        )
    )


_SHOWN = {
    "exceptions": "exceptions",
    "nan": "NaN",
    "negative": "negative volumes",
    "false_zeros": "zero although they overlap",
    "largest_missed": "largest of those, of the sphere",
    "false_positives": "above zero although they do not",
    "largest_false_positive": "largest of those, of the sphere",
    "excess": "largest excess over the smaller volume, of the sphere",
}
_SHOWN_OF_OURS = {
    "asymmetry": "largest change under relabelling, of the sphere",
    "shrinking": "largest loss as the radius grows, of the sphere",
    "precise": "took the compensated forms",
}


def _large_errors(samples: list[Sample], python_peer: PythonPeer | None) -> int:
    """How many errors are above 1e-6 of the sphere; NaN and exceptions count."""
    large = 0
    for sample in samples:
        if python_peer is None:
            volumes = our_volumes(sample.pairs)[0]
        elif sample.pairs.solid in ("tetrahedron", "box"):
            volumes = python_peer.volumes(sample.pairs, mend="inverted" not in sample.name)[0]
        else:
            continue
        large += int((sample.errors(volumes) > LARGE_ERROR).sum())
    return large


def _most(values: FloatArray) -> float:
    return max(0.0, float(values.max())) if len(values) else 0.0
