"""How fast and how exact are the overlaps, compared with other methods?

feelahead bench overlap --quick --peer-header overlap-0.2.0/include/overlap/overlap.hpp
"""

import functools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from msgspec import Meta
from rich.table import Table as Shown

from common.arrays import FloatArray
from common.clock import MonotonicClock
from common.files.input_file import require_input_file
from feelahead.lab.goals import Goal
from feelahead.lab.interleaved import interleaved, least_ns
from feelahead.lab.reference import errors
from feelahead.lab.reference.approximations import SLOW, satellites
from feelahead.lab.reference.classes import DEPTHS, MAKERS, family, frozen_class
from feelahead.lab.reference.meshes import around_torus, torus
from feelahead.lab.reference.oracle import true_overlaps
from feelahead.lab.reference.pairs import Pairs
from feelahead.lab.reference.published import SDIST, CompiledHeader, PythonPackage
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from feelahead.printing.pictures import figure
from robot_side.overlap import Mesh, sphere_box, sphere_tetrahedron

OURS, KERNEL, PACKAGE, HEADER = "ours, checked", "ours, kernel", "overlap, Python", "overlap, C++"
FASTER, BOXES_A_QUERY, FEW_TRIANGLES = 13.0, 20.0, 50
Groups = Iterable[tuple[tuple[Any, ...], Table]]
_BATCH = 4096
_SPEED = ("random", "far away", "solid swallowed", "sphere swallowed")
_TRADED = ("random", "tangent vertex", "flat 1e-3", "R/L 1e-2", "R/L 1e2", "edge depth 1e-3")
_RADII = (0.004, 0.01, 0.02, 0.03, 0.045, 0.07, 0.1, 0.12, 0.15, 0.25, 0.4, 0.6)
_CLASSES = [(solid, name, grid) for solid, makers in MAKERS.items() for name in makers for grid in (False, True)]
_FLAT_FACED = ("tetrahedron", "box")
_COUNTS = ("pairs", "undefined", "negative", "false_zeros", "false_positives")


@dataclass(frozen=True)
class OverlapSweep(Sweep):
    """Measure run time and error of the overlaps and of their alternatives, on the same pairs in the same run.

    The alternatives are the published package `overlap` 0.2.0 from Python and in C++, 29 satellite points, Monte Carlo
    and more. Those that this machine lacks are named. The package comes with: pip install '.[bench]' in the clone. The
    C++ row needs a compiler, Eigen (apt-get install libeigen3-dev) and the package's header:

        pip download --no-deps --no-binary overlap overlap==0.2.0 && tar xzf overlap-0.2.0.tar.gz
    """

    peer_header: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """overlap.hpp of the package's source distribution, for the C++ row."""
    adversarial: Annotated[Annotated[int, Meta(ge=1, le=10**8)] | None, tyro.conf.arg(metavar="PAIRS")] = None
    """Number of adversarial pairs; 100000 unless given, 20000 with --quick."""
    truths: Annotated[Annotated[int, Meta(ge=2, le=10**6)] | None, tyro.conf.arg(metavar="PAIRS")] = None
    """Number of pairs of each class that are compared with the truth; 40 unless given, 6 with --quick."""
    timed: Annotated[int, Meta(ge=10, le=10**7), tyro.conf.arg(metavar="PAIRS")] = 5 * _BATCH
    """Number of timed pairs, in batches of 4096."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.peer_header is not None:
            require_input_file("--peer-header", self.peer_header, f"overlap.hpp, from: {SDIST}")


@dataclass(frozen=True)
class Piece:
    """Cell: one class of pairs, one set of timed pairs, or one radius of mesh queries."""

    part: Literal["speed", "accuracy", "adversarial", "tradeoff", "mesh"]
    solid: str
    case: str
    grid: bool
    count: int
    rounds: int
    header: str | None = None


def cells(settings: OverlapSweep) -> Iterator[Piece]:
    """Yield the cells: first those that measure time, then errors and counts for each class."""
    rounds, timed = (5 if settings.quick else 20), settings.timed
    header = None if settings.peer_header is None else str(settings.peer_header)
    truths = settings.truths or (6 if settings.quick else 40)
    wanted = settings.adversarial or (20_000 if settings.quick else 100_000)
    for solid, case in product(_FLAT_FACED, _SPEED):
        yield Piece("speed", solid, case, False, timed, rounds, header)
    for radius in _RADII:
        yield Piece("mesh", "mesh", f"{radius:g}", False, min(timed, 500), rounds)
    for solid, case in product(_FLAT_FACED, _TRADED):
        yield Piece("tradeoff", solid, case, False, truths, 2 if settings.quick else 4)
    for one in _CLASSES:
        yield Piece("accuracy", *one, truths, rounds)
    for one in _CLASSES:
        yield Piece("adversarial", *one, -(-wanted // len(_CLASSES)), rounds)


def run(cell: Piece, seed: int) -> Iterator[Row]:
    """Measure one cell; yield a row for each method."""
    parts = {"speed": _speed, "accuracy": _accuracy, "adversarial": _failures, "tradeoff": _tradeoff, "mesh": _mesh}
    yield from parts[cell.part](cell, seed)


def _pairs(cell: Piece, seed: int) -> Pairs:
    return frozen_class(cell.solid, cell.case, cell.count, grid=cell.grid, seed=seed)[1]


def _package_volumes(cell: Piece, pairs: Pairs) -> FloatArray | None:
    package = PythonPackage()
    if package.missing or cell.solid not in _FLAT_FACED:
        return None
    return package.volumes(pairs, mend=cell.case != "inverted")


@functools.cache
def _header(path: str | None) -> CompiledHeader:
    return CompiledHeader(None if path is None else Path(path))


def _checked(pairs: Pairs) -> object:
    return (sphere_box if pairs.solid == "box" else sphere_tetrahedron)(*pairs.arguments, gradient=True)


def _speed(cell: Piece, seed: int) -> Iterator[Row]:
    """Measure all methods interleaved on the same pairs; the least time of each batch counts."""
    clock = MonotonicClock()
    pairs = errors.partial_pairs(cell.solid, cell.count, seed + 1) if cell.case == "random" else _pairs(cell, seed + 1)
    batches = [pairs[slice(first, first + _BATCH)] for first in range(0, len(pairs), _BATCH)]
    contenders: dict[str, Callable[[], FloatArray]] = {
        OURS: lambda: least_ns([functools.partial(_checked, batch) for batch in batches], clock),
        KERNEL: lambda: least_ns([functools.partial(errors.kernel_overlaps, batch) for batch in batches], clock),
    }
    package, header = PythonPackage(), _header(cell.header)
    if not header.missing:
        contenders[HEADER] = lambda: header.timed(pairs)[0]
    for method, missing in ((PACKAGE, package.missing), (HEADER, header.missing)):
        if missing:
            yield {"method": method, "missing": missing}
    for method, time_ns in interleaved(contenders, cell.rounds).items():
        yield {"method": method, "ns": time_ns / len(pairs)}


def _accuracy(cell: Piece, seed: int) -> Iterator[Row]:
    pairs = _pairs(cell, seed)
    truths = true_overlaps(pairs)
    found = errors.compare(pairs, truths, errors.kernel_overlaps(pairs))
    relative = "shallow" if any(f"depth {depth}" in cell.case for depth in DEPTHS) else "relative"
    known = found.shares > 0.0 if relative == "shallow" else found.shares >= errors.LEAST_SHARE
    worst = {name: float(getattr(found, name).max()) for name in ("volume", "gradient", "area", "direction")}
    group = {"family": family(f"{cell.case}, general")}
    yield {"method": "ours", **group, **worst, relative: float(found.relative[known].max(initial=0.0))}
    if (volumes := _package_volumes(cell, pairs)) is not None:
        answered = np.isfinite(volumes)
        most = {"volume": float(errors.volume_errors(pairs, truths, volumes)[answered].max(initial=0.0))}
        most[relative] = float(errors.relative_errors(truths, volumes)[known & answered].max(initial=0.0))
        yield {"method": PACKAGE, **group, **most, "undefined": int((~answered).sum())}


def _failures(cell: Piece, seed: int) -> Iterator[Row]:
    pairs = _pairs(cell, seed + 1)
    volumes = errors.kernel_volumes(pairs)
    shares = {"asymmetry": errors.asymmetry(pairs, volumes), "shrinking": errors.shrinking(pairs, volumes)}
    yield {"method": "ours", **asdict(errors.count_failures(pairs, volumes)), **shares}
    if (theirs := _package_volumes(cell, pairs)) is not None:
        yield {"method": PACKAGE, **asdict(errors.count_failures(pairs, theirs))}


def _tradeoff(cell: Piece, seed: int) -> Iterator[Row]:
    """Measure time and worst error of every method; slow methods get only a few pairs, all of which intersect."""
    clock, pairs = MonotonicClock(), _pairs(cell, seed)
    truths = true_overlaps(pairs)
    methods: dict[str, tuple[Callable[[Pairs], FloatArray], int]]
    methods = {"ours, batch": (errors.kernel_volumes, _BATCH), "29 points": (satellites, _BATCH)}
    methods |= {name: (volumes_of, cell.rounds) for name, volumes_of in SLOW.items()}
    if not (package := PythonPackage()).missing:
        methods[PACKAGE] = package.volumes, len(pairs)
    cut = np.flatnonzero([truth.faces_cut > 0 and truth.area != 0 for truth in truths])
    for method, (volumes_of, count) in methods.items():
        rows = cut[:count] if count < len(pairs) and len(cut) else np.arange(len(pairs))
        start_s = clock.now()
        volumes = volumes_of(pairs[rows])
        time_ns = 1e9 * (clock.now() - start_s) / len(rows)
        wrong = errors.volume_errors(pairs[rows], [truths[row] for row in rows], volumes)
        if count == _BATCH:
            many = pairs[np.resize(np.arange(len(pairs)), _BATCH)]
            time_ns = float(least_ns([functools.partial(volumes_of, many)], clock)[0]) / _BATCH
        yield {"method": method, "ns": time_ns, "volume": float(np.minimum(wrong, 1.0).max())}


def _mesh(cell: Piece, seed: int) -> Iterator[Row]:
    """Measure the time of overlaps of spheres with a torus of 10 000 triangles, around whose surface they lie."""
    clock, radius, rng = MonotonicClock(), float(cell.case), np.random.default_rng([seed, 5])
    mesh, spheres = Mesh(*torus(100, 50)), (around_torus(rng, cell.count, radius), radius)
    query = functools.partial(mesh.overlap, *spheres)
    calls = (("ns", query), ("gradient_ns", functools.partial(query, gradient=True)))
    contenders = {name: functools.partial(least_ns, [call], clock) for name, call in calls}
    times = {name: time_ns / cell.count for name, time_ns in interleaved(contenders, cell.rounds).items()}
    yield {"method": "ours", "triangles": float(mesh.counts(*spheres).mean()), **times}


def show(_: OverlapSweep, table: Table) -> Iterator[Shown | str]:
    """Yield a table for each part of the question: a row for each method, class, count or radius."""
    parts = ("speed", "tradeoff", "accuracy", "adversarial", "mesh")
    speed, tradeoff, accuracy, adversarial, meshes = (table.where(part=part) for part in parts)
    for rows, name, title in (
        (speed, "ns", "run time, ns a pair, gradients included (the package gives volumes only)"),
        (tradeoff, "ns", "run time, ns a pair, volumes alone"),
        (tradeoff, "volume", "and the worst error, of the sphere"),
    ):
        columns = list(rows.groups("solid", "case"))
        headings = ("method", *(", ".join(key) for key, _ in columns))
        by_method = (
            (method, *(_most(one.where(method=method), name) for _, one in columns))
            for (method,), _ in rows.groups("method")
        )
        yield shown(title, headings, by_method)
    yield from dict.fromkeys(f"not measured: {row['method']}: {row['missing']}" for row in speed if "missing" in row)
    names = ("volume", "gradient", "area", "relative", "direction")
    every = [*((name, "ours") for name in names), ("volume", PACKAGE)]
    title = "worst errors, of the sphere, great circle and surface; relative for overlaps from 1e-12 of the sphere"
    yield shown(title, ("class", *names, PACKAGE), _rows(accuracy.groups("solid", "family"), every))
    shallow = Table(row for row in accuracy if "shallow" in row).groups("solid", "case")
    both = [("shallow", "ours"), ("shallow", PACKAGE)]
    yield shown("shallow overlaps, worst relative error", ("class", "ours", PACKAGE), _rows(shallow, both))
    counts = [
        (name, *(_total(adversarial.where(method=method), name) for method in ("ours", PACKAGE)))
        for name in (*_COUNTS, "largest_missed", "largest_false_positive", "excess", "asymmetry", "shrinking")
    ]
    yield shown("adversarial pairs: counts, and largest shares of the sphere", ("", "ours", PACKAGE), counts)
    of_mesh = ("triangles", "ns", "gradient_ns")
    queries = _rows(meshes.groups("case"), [(name, "ours") for name in of_mesh])
    yield shown("a torus of 10 000 triangles, ns a query, by triangles evaluated", ("radius, m", *of_mesh), queries)


def _rows(groups: Groups, columns: list[tuple[str, str]]) -> Iterator[tuple[str | float | None, ...]]:
    for key, rows in groups:
        yield (", ".join(key), *(_most(rows.where(method=method), name) for name, method in columns))


def _total(rows: Table, name: str) -> float | None:
    return sum(rows.values(name)) if name in _COUNTS and rows.values(name) else _most(rows, name)


def _most(rows: Table, name: str) -> float | None:
    return max(rows.values(name), default=None)


def goals(_: OverlapSweep, table: Table) -> Iterator[Goal]:
    """Yield the goals for the kernels' time and errors."""
    ours = table.where(method="ours")
    accuracy, counted, meshes = (ours.where(part=part) for part in ("accuracy", "adversarial", "mesh"))
    deep = Table(row for row in accuracy if not row["case"].endswith("1e-9"))
    of = f"of {_total(counted, 'pairs'):g} adversarial pairs"
    for rows, name, claim, limit in (
        (accuracy, "volume", "worst error over every class, of the sphere", 1e-15),
        (deep, "shallow", "relative error of face, edge and corner overlaps of depth >= 1e-6 R", 1e-9),
        (accuracy, "direction", "direction of the gradient, overlaps from 1e-12 of the sphere, rad", 1e-6),
        (counted, "false_zeros", f"false zeros {of}", 0.0),
        (counted, "negative", f"negative volumes {of}", 0.0),
        (counted, "undefined", f"exceptions and NaN {of}", 0.0),
        (counted, "asymmetry", "change under relabelling, of the sphere", 1e-15),
        (counted, "shrinking", "loss as the radius grows, of the sphere", 1e-15),
    ):
        worst = max((row for row in rows if name in row), key=lambda row: row[name])
        where = ", ".join((worst["solid"], worst["case"], "grid" if worst["grid"] else "general"))
        yield Goal(claim, _total(rows, name), limit, detail=where if worst[name] else "")
    speed = {(row["method"], row["solid"], row["case"]): row.get("ns") for row in table.where(part="speed")}
    for solid in _FLAT_FACED:
        mine, theirs = (speed.get((method, solid, "random")) for method in (OURS, HEADER))
        ratio = None if mine is None or theirs is None else theirs / mine
        yield Goal(f"times faster than the C++ package, {solid}, checked, with gradient", ratio, FASTER, "at least")
    few = max(row["ns"] for row in meshes if row["triangles"] <= FEW_TRIANGLES) / speed[KERNEL, "box", "random"]
    yield Goal(f"mesh query with up to {FEW_TRIANGLES} triangles, in boxes", few, BOXES_A_QUERY)


def draw(_: OverlapSweep, table: Table, path: Path) -> None:
    """Draw run time against error, and the time of a mesh query against the number of triangles that it visits."""
    with figure(path, 1, 2, figsize=(13.0, 4.6)) as (_, (left, right)):
        for number, ((method,), rows) in enumerate(table.where(part="tradeoff").groups("method")):
            errors = np.maximum(rows.values("volume"), 1e-18)
            left.scatter(rows.values("ns"), errors, 16, label=method, marker="ox^"[number // 5], color=f"C{number % 5}")
        left.axhline(1e-15, color="black", linewidth=0.6, linestyle=":")
        left.set(xscale="log", yscale="log", xlabel="time, ns a pair", ylabel="worst error / sphere volume")
        meshes = table.where(part="mesh")
        for name, label in (("ns", "volume"), ("gradient_ns", "with gradient")):
            right.plot(meshes.values("triangles"), meshes.values(name), "o", label=label)
        right.set(xscale="symlog", yscale="log", xlabel="triangles evaluated", ylabel="ns a query")
        for axes in (left, right):
            axes.grid(alpha=0.3)
            axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))


QUESTION = Question("bench overlap", OverlapSweep, cells, run, show, draw, goals, timed=True)
