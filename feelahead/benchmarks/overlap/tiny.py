"""Tiny overlaps: relative errors by feature and depth, and the gradient's direction by the overlap's size."""

import math

import numpy as np
from rich.progress import Progress

from feelahead.benchmarks.overlap.accuracy import Sample
from feelahead.benchmarks.overlap.classes import DEPTHS, touching
from feelahead.benchmarks.overlap.features import FEATURES
from feelahead.benchmarks.overlap.ours import kernel_overlaps
from feelahead.benchmarks.overlap.pairs import Pairs
from feelahead.benchmarks.overlap.peers import PythonPeer
from feelahead.benchmarks.overlap.truth import true_overlap
from feelahead.benchmarks.report import Report, Table, short

SMALLEST_SHARE = 1e-12
"""Of the sphere's volume: the smallest overlap whose gradient must point the right way."""
_LARGEST_SHARE = 1e-2
_DEPTHS = tuple(2.0**-power for power in range(3, 22, 2))


def measure_tiny(report: Report, samples: list[Sample], python_peer: PythonPeer) -> None:
    """Relative errors at depths of 1e-3, 1e-6 and 1e-9 radii, from the samples of the classes named so."""
    rows = []
    for solid in ("tetrahedron", "box"):
        for feature in FEATURES:
            for depth in DEPTHS:
                chosen = [s for s in samples if s.name.startswith(f"{solid}, {feature} depth {depth},")]
                ours = max(_worst_relative(sample) for sample in chosen)
                case = f"{feature} depth {depth}"
                report.add("tiny", "ours", solid, case, {"worst relative error": (ours, "")})
                peer = "-"
                if not python_peer.missing:
                    worst = max(_worst_relative(sample, python_peer) for sample in chosen)
                    report.add("tiny", "overlap, Python", solid, case, {"worst relative error": (worst, "")})
                    peer = short(worst)
                rows.append((f"{solid}, {feature}", depth, short(ours), peer))
    report.tables.append(
        Table(
            "Tiny overlaps, worst relative error",
            ("feature", "depth / R", "ours", "overlap 0.2.0"),
            rows,
            "Half of the pairs grid-aligned. 1 means that nothing of the volume is right, or a false zero; inf a "
            "volume where there is none, or NaN or an exception of the package.",
        )
    )


def _worst_relative(sample: Sample, python_peer: PythonPeer | None = None) -> float:
    touching_rows = np.array([bool(truth.volume) for truth in sample.truths])
    if not touching_rows.any():
        return 0.0
    volumes = kernel_overlaps(sample.pairs)[0] if python_peer is None else python_peer.volumes(sample.pairs)[0]
    return float(sample.relative_errors(volumes)[touching_rows].max())


def measure_directions(report: Report, count: int, seed: int, progress: Progress) -> None:
    """The error of the gradient's direction for overlaps from 1e-12 to 1e-2 of the sphere, a decade a row."""
    decades: dict[int, list[float]] = {}
    bar = progress.add_task("directions", total=2 * 2 * len(FEATURES) * len(_DEPTHS))
    for solid in ("tetrahedron", "box"):
        for feature in FEATURES:
            for number, depth in enumerate(_DEPTHS):
                for grid in (False, True):
                    rng = np.random.default_rng([seed, number, grid, len(feature), len(solid)])
                    for decade, error in _direction_errors(touching(solid, feature, depth)(rng, count, grid)):
                        decades.setdefault(decade, []).append(error)
                    progress.advance(bar)
    rows = []
    for decade in sorted(decades, reverse=True):
        worst = max(decades[decade])
        case = f"overlap 1e{decade} of the sphere"
        report.add("directions", "ours", "both", case, {"worst direction error": (worst, "rad")})
        rows.append((f"1e{decade}", str(len(decades[decade])), short(worst)))
    report.tables.append(
        Table(
            "Direction of the gradient",
            ("overlap / sphere, above", "pairs", "worst error, rad"),
            rows,
            "Faces, edges and vertices of tetrahedra and boxes, by the decade of the true overlap.",
        )
    )


def _direction_errors(pairs: Pairs) -> list[tuple[int, float]]:
    """(Decade of the true share of the sphere, the direction's error) of the pairs in range."""
    gradients = kernel_overlaps(pairs)[1]
    found = []
    for row in range(len(pairs)):
        truth = true_overlap(pairs, row)
        share = float(truth.volume) / float(pairs.sphere_volumes[row])
        # A solid that is swallowed whole has no direction; a sphere that just reaches in has |∇V| >> V/R.
        slope = math.hypot(*(float(component) for component in truth.gradient))
        reaching_in = slope * float(pairs.radii[row]) > float(truth.volume)
        if SMALLEST_SHARE <= share <= _LARGEST_SHARE and reaching_in:
            found.append((math.floor(math.log10(share)), truth.direction_error(gradients[row])))
    return found
