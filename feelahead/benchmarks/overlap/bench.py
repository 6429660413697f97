"""`feelahead bench overlap`: run time against error of exact overlaps and of everything used in their place."""

import importlib.metadata
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.progress import Progress

from common.clock import MonotonicClock
from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from common.files.input_file import require_input_file
from common.files.output_file import require_output_file
from feelahead.benchmarks.overlap.accuracy import draw_samples, measure_accuracy
from feelahead.benchmarks.overlap.classes import MAKERS, frozen_classes
from feelahead.benchmarks.overlap.distances import measure_distances
from feelahead.benchmarks.overlap.goals import judge
from feelahead.benchmarks.overlap.meshes import measure_meshes
from feelahead.benchmarks.overlap.peers import SDIST, HeaderPeer, PythonPeer
from feelahead.benchmarks.overlap.plots import draw
from feelahead.benchmarks.overlap.stress import count_failures
from feelahead.benchmarks.overlap.times.call_sizes import measure_call_sizes
from feelahead.benchmarks.overlap.times.speed import BATCH, measure_speed, partial_pairs
from feelahead.benchmarks.overlap.times.timing import available_cores
from feelahead.benchmarks.overlap.times.widths import measure_widths
from feelahead.benchmarks.overlap.tiny import measure_directions, measure_tiny
from feelahead.benchmarks.overlap.tradeoff import measure_tradeoff
from feelahead.benchmarks.report import Report, Table, markdown, show, show_goals, write_csv
from robot_side.compiled.processor import processor_name
from robot_side.overlap import warm_up

PROGRAM = "feelahead bench overlap"
_WIDE = 150
_CLASSES = 2 * sum(len(makers) for makers in MAKERS.values())


@dataclass(frozen=True)
class OverlapBenchSettings:
    """How fast and how exact the overlaps are, beside everything that is used in their place.

    Measured on the same pairs in the same run: our kernels, the published package `overlap` 0.2.0 from Python and
    in C++, 29 satellite points, Monte Carlo, voxels, SciPy quadrature, and a distance instead. Errors are taken
    against truths of 30 digits or more, and what must never happen is counted over adversarial pairs.

    What is missing on this machine is named where it would stand: pip install 'feelahead[bench]' brings the package;
    the C++ row needs a compiler, Eigen (apt-get install libeigen3-dev) and the package's header:

        pip download --no-deps --no-binary overlap overlap==0.2.0 && tar xzf overlap-0.2.0.tar.gz

    Try: feelahead bench overlap --quick --peer-header overlap-0.2.0/include/overlap/overlap.hpp
    """

    quick: bool = False
    """Under a minute, with fewer pairs; without, up to ten."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write every figure there: section, method, solid, case, quantity, value, unit."""
    figures: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Write two PNG figures there: error against time, and the cost of a mesh query."""
    write_docs: Annotated[Path | None, tyro.conf.arg(metavar="FILE.md")] = None
    """Write the tables as Markdown there, and the figures into a folder of the same name beside it."""
    peer_header: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """overlap.hpp of the package's source distribution, for the C++ row."""
    adversarial: Annotated[int | None, tyro.conf.arg(metavar="PAIRS")] = None
    """How many adversarial pairs; 100000 unless given, 20000 with --quick."""
    truths: Annotated[int | None, tyro.conf.arg(metavar="PAIRS")] = None
    """How many pairs of each class are compared with the truth; 40 unless given, 6 with --quick."""
    timed: Annotated[int | None, tyro.conf.arg(metavar="PAIRS")] = None
    """How many pairs are timed, in batches of 4096; 20480 unless given."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Of the pairs: another seed gives others of the same classes."""

    def __post_init__(self) -> None:
        for name, least, most in (("adversarial", 1, 10**8), ("truths", 2, 10**6), ("timed", 10, 10**7)):
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ValueError(f"--{name} {value}: valid: {least} to {most}")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or more")
        if self.peer_header is not None:
            require_input_file("--peer-header", self.peer_header, f"overlap.hpp, from: {SDIST}")
        require_output_file("--csv", self.csv)
        require_output_file("--write-docs", self.write_docs)
        if self.figures is not None and self.figures.exists() and not self.figures.is_dir():
            raise ValueError(f"--figures {self.figures}: is a file; valid: a folder")


def bench_overlap(arguments: Sequence[str]) -> int:
    """Run the benchmark; exit code 0 whether or not the goals are met."""
    settings = parse_settings(OverlapBenchSettings, PROGRAM, arguments)
    # Tables of a dozen columns: where nobody's window bounds them, they get room.
    console = Console() if Console().is_terminal else Console(width=_WIDE)
    header_peer = HeaderPeer(settings.peer_header)
    try:
        with Progress(console=console, transient=True) as progress:
            report = measure(settings, header_peer, progress)
    finally:
        header_peer.close()
    tables = [_machine(settings), *report.tables]
    for table in tables:
        show(console, table)
    show_goals(console, report.goals)
    try:
        _write(settings, report, tables)
    except OSError as error:
        raise ConfigurationError(f"cannot write {error.filename}: {error.strerror}") from error
    return 0


def measure(settings: OverlapBenchSettings, header_peer: HeaderPeer, progress: Progress) -> Report:
    """Everything, in the order in which it is shown."""
    clock, report, python_peer = MonotonicClock(), Report(), PythonPeer()
    steps = progress.add_task("benchmark", total=7)
    report.add("start", "ours", "all", "kernels", {"warm-up": (warm_up(), "s")})
    repeats, turns = (5, 5) if settings.quick else (15, 20)
    timed = settings.timed or 5 * BATCH
    measure_speed(report, (python_peer, header_peer), progress, timed, turns, clock)
    measure_call_sizes(report, progress, timed, turns, clock)
    if not settings.quick:
        measure_widths(report, progress, turns)
    progress.advance(steps)
    measure_distances(report, partial_pairs("box", min(timed, 2000)), repeats, clock)
    measure_meshes(report, progress, min(timed, 500), turns, 2 if settings.quick else 6, clock, small=timed < 1000)
    progress.advance(steps)
    truths = settings.truths or (6 if settings.quick else 40)
    samples = draw_samples(frozen_classes(truths, settings.seed), progress)
    progress.advance(steps)
    measure_accuracy(report, samples, python_peer)
    measure_tiny(report, samples, python_peer)
    progress.advance(steps)
    measure_directions(report, min(truths, 10), settings.seed, progress)
    progress.advance(steps)
    wanted = settings.adversarial or (20_000 if settings.quick else 100_000)
    each = -(-wanted // _CLASSES)
    count_failures(report, frozen_classes(each, settings.seed + 1), samples, python_peer, progress)
    progress.advance(steps)
    measure_tradeoff(report, samples, (python_peer, header_peer), clock, progress, quick=settings.quick)
    progress.advance(steps)
    judge(report, processor())
    return report


def _machine(settings: OverlapBenchSettings) -> Table:
    versions = [("Python", platform.python_version())]
    for package in ("numpy", "numba", "mpmath", "scipy", "overlap", "mujoco-core", "coal"):
        try:
            versions.append((package, importlib.metadata.version(package)))
        except importlib.metadata.PackageNotFoundError:
            versions.append((package, "not installed"))
    rows = [
        ("processor", processor()),
        ("cores", str(available_cores())),
        ("system", f"{platform.system()} {platform.machine()}"),
        ("versions", ", ".join(f"{name} {version}" for name, version in versions)),
        ("run", "quick" if settings.quick else "full"),
    ]
    return Table("Machine", ("", "value"), rows)


def processor() -> str:
    """What this machine calls its processor, what LLVM takes it for, and its widest vectors."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    flags = next((line for line in lines if line.startswith("flags")), "")
    vectors = "AVX-512" if " avx512f" in flags else "AVX2" if " avx2" in flags else "no AVX2"
    return f"{names[0] if names else platform.processor() or 'unknown'} ({processor_name()}, {vectors})"


def _write(settings: OverlapBenchSettings, report: Report, tables: list[Table]) -> None:
    if settings.csv is not None:
        write_csv(settings.csv, report.figures)
    if settings.figures is not None:
        draw(report, settings.figures)
    if settings.write_docs is None:
        return
    folder = settings.write_docs.with_suffix("")
    pictures = [f"![{path.stem.replace('_', ' ')}]({folder.name}/{path.name})" for path in draw(report, folder)]
    machine, *measured = tables
    text = [
        "# Benchmarks: exact overlaps",
        "",
        f"Every figure here comes from `{_command(settings)}` on the machine named below; run it on yours. Its "
        "`--help` says how to get what it compares with. Goals that are missed are shown as such.",
        "",
        markdown(machine),
        markdown(report.goal_table()),
        "## Figures",
        "",
        *(f"{picture}\n" for picture in pictures),
        *(markdown(table) for table in measured),
    ]
    settings.write_docs.write_text("\n".join(text), encoding="utf-8")


def _command(settings: OverlapBenchSettings) -> str:
    """The command that gives the same again, without the folders of this machine."""
    words = [PROGRAM]
    if settings.quick:
        words.append("--quick")
    for name in ("adversarial", "truths", "timed"):
        if getattr(settings, name) is not None:
            words += [f"--{name}", str(getattr(settings, name))]
    if settings.seed:
        words += ["--seed", str(settings.seed)]
    for name in ("peer_header", "write_docs"):
        path: Path | None = getattr(settings, name)
        if path is not None:
            words += [f"--{name.replace('_', '-')}", path.name if path.is_absolute() else str(path)]
    return " ".join(words)
