"""Queries of a closed mesh of 10 000 triangles: time against the number of triangles that the sphere touches."""

from functools import partial
from typing import Any

import numpy as np
from rich.progress import Progress

from common.arrays import FloatArray, IntArray
from common.clock import Clock
from feelahead.benchmarks.overlap.contact import nearest_points
from feelahead.benchmarks.overlap.times.timing import in_turns, short_calls
from feelahead.benchmarks.overlap.truth import true_mesh_overlap
from feelahead.benchmarks.report import Report, Table, short
from robot_side import overlap

TORUS = (1.0, 0.35)
"""Radii (m) of the ring and of its tube."""
FEW_TRIANGLES = 50
"""Up to so many triangles a query is to cost less than 20 boxes."""
_AT_ONCE = 250
"""Queries of a call."""
_RADII = (0.004, 0.01, 0.02, 0.03, 0.045, 0.07, 0.1, 0.12, 0.15, 0.25, 0.4, 0.6)


def torus(around: int, across: int) -> tuple[FloatArray, IntArray]:
    """Vertices (around · across, 3) in m and triangles (2 · around · across, 3) of a torus, which is not convex."""
    turn, tilt = np.meshgrid(
        2.0 * np.pi * np.arange(around) / around, 2.0 * np.pi * np.arange(across) / across, indexing="ij"
    )
    ring, tube = TORUS
    reach = ring + tube * np.cos(tilt)
    vertices = np.stack([reach * np.cos(turn), reach * np.sin(turn), tube * np.sin(tilt)], axis=-1).reshape(-1, 3)
    number = np.arange(around * across).reshape(around, across)
    right, up = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
    corner = np.roll(right, -1, axis=1)
    triangles = np.concatenate(
        [
            np.stack([number, right, corner], axis=-1).reshape(-1, 3),
            np.stack([number, corner, up], axis=-1).reshape(-1, 3),
        ]
    )
    return vertices, triangles.astype(np.int64)


def measure_meshes(
    report: Report, progress: Progress, queries: int, turns: int, truths: int, clock: Clock, *, small: bool
) -> None:
    """Add the time of a query for spheres of several radii, and the worst error of `truths` of them.

    `small` takes a torus of 400 triangles instead of 10 000.
    """
    mesh_type = getattr(overlap, "Mesh", None)
    if mesh_type is None:
        report.tables.append(Table("Meshes", ("",), [("this build has no mesh kernel",)]))
        return
    vertices, triangles = torus(20, 10) if small else torus(100, 50)
    start_s = clock.now()
    mesh = mesh_type(vertices, triangles)
    report.add("mesh", "ours", "mesh", "preparation", {"time": (1e3 * (clock.now() - start_s), "ms")})
    rng = np.random.default_rng(5)
    box_ns = report.value("speed", "ours, kernel", "box", "partial", "time")
    rows = []
    bar = progress.add_task("mesh queries", total=len(_RADII))
    for radius in _RADII:
        centers = _near_surface(rng, queries, radius)
        radii = np.full(queries, radius)
        touched = float(np.mean([_touched(vertices, triangles, center, radius) for center in centers[:20]]))
        parts = [slice(first, first + _AT_ONCE) for first in range(0, queries, _AT_ONCE)]
        contenders = [
            short_calls(
                name,
                [partial(mesh.overlap, centers[part], radii[part], gradient=gradient) for part in parts],
                queries,
                clock,
            )
            for name, gradient in (("time", False), ("time, gradient", True))
        ]
        times = in_turns(contenders, turns)
        case = f"radius {radius:g} m"
        values = {"triangles": (touched, ""), **{name: (each_ns, "ns/query") for name, each_ns in times.items()}}
        report.add("mesh", "ours", "mesh", case, values)
        ratio = "" if box_ns is None else short(times["time"] / box_ns)
        progress.advance(bar)
        rows.append((f"{radius:g}", f"{touched:.0f}", *(short(each_ns) for each_ns in times.values()), ratio))
    report.tables.append(
        Table(
            f"Meshes: a torus of {len(triangles)} triangles",
            ("radius, m", "triangles touched", "ns a query", "with gradient", "times a box"),
            rows,
            "Centres at random depths around the surface; triangles touched are the mean of 20 queries; a box: "
            f"our kernel on partial pairs, above. Checked calls of {_AT_ONCE} queries.",
        )
    )
    worst = _worst_error(mesh, truths)
    report.add("mesh", "ours", "mesh", "torus of 400 triangles", {"worst error": (worst, "of the sphere")})


def _near_surface(rng: np.random.Generator, count: int, radius: float) -> FloatArray:
    ring, tube = TORUS
    turn, tilt = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    reach = tube + radius * rng.uniform(-0.8, 0.8, count)
    flat = ring + reach * np.cos(tilt)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), reach * np.sin(tilt)], axis=-1)


def _touched(vertices: FloatArray, triangles: IntArray, center: FloatArray, radius: float) -> int:
    """How many triangles have a point within the sphere."""
    nearest = nearest_points(vertices[triangles] - center, ((0, 1, 2),))
    return int(np.count_nonzero(np.einsum("ni,ni->n", nearest, nearest) < radius * radius))


def _worst_error(mesh: Any, count: int) -> float:
    """Of `count` spheres around a coarse torus, as a share of the sphere's volume."""
    vertices, triangles = torus(20, 10)
    coarse = type(mesh)(vertices, triangles)
    rng = np.random.default_rng(6)
    centers, radii = _near_surface(rng, count, 0.3), np.full(count, 0.3)
    volumes = coarse.overlap(centers, radii, gradient=False)
    errors = [
        true_mesh_overlap(center, radius, vertices, triangles).volume_error(float(volume)) / (4.18879 * radius**3)
        for center, radius, volume in zip(centers, radii.tolist(), volumes, strict=True)
    ]
    return float(max(errors))
