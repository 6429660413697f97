"""Engine of all questions: run each cell of a grid with each seed, and collect all rows in one tidy table.

A question defines its cells, how to run one cell, and its tables. The engine does the rest: seeds that do not depend on
the order, progress, workers or a cluster, a journal that survives kill -9, CSV and Parquet, goals and figures. The
table's rows are in the order of the grid. So the table is the same to the byte for any number of workers, and after any
interruption.
"""

import functools
import hashlib
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, TypeVar

import numpy as np
import tyro
from msgspec import Meta
from rich.console import Console, RenderableType

from common.command.command_line import parse_settings
from common.errors import ConfigurationError, FeelaheadError
from common.files.output_file import require_output_file, write_json
from common.limits import check_limits
from common.recording.provenance import provenance
from feelahead.lab.goals import Goal, show_goals
from feelahead.lab.journal import Journal
from feelahead.lab.pieces import Piece, results
from feelahead.lab.scheduler import Scheduler
from feelahead.lab.table import Row, Table
from feelahead.printing.pictures import PICTURES
from feelahead.printing.progress import progress

_ROOT = Path(__file__).parents[2]
_PACKAGES = ("common", "operator_side", "robot_side", "feelahead")
_MOST_RUNS = 10_000_000
_INTERRUPTED = 130
"""Exit code by which shells report that Ctrl-C has ended a command."""
_WIDTH = 200
"""Width of the output where it goes to no terminal, in columns."""


@dataclass(frozen=True)
class Sweep:
    """Flags that every question has; the settings class of a question inherits from this class."""

    quick: bool = False
    """Run only a small grid, which shows in a few minutes whether anything is wrong."""
    seed: Annotated[int, Meta(ge=0), tyro.conf.arg(metavar="N")] = 0
    """First seed."""
    seeds: Annotated[int, Meta(ge=1), tyro.conf.arg(metavar="N")] = 1
    """Number of seeds; each cell is run with each of them."""
    workers: Annotated[Annotated[int, Meta(ge=1)] | None, tyro.conf.arg(metavar="N")] = None
    """Number of cells that run at the same time, each in its own process on this machine; 2 unless given. With 1 the
    cells run one by one in this process."""
    scheduler: Annotated[str | None, tyro.conf.arg(metavar="tls://HOST:PORT")] = None
    """Run the cells on the cluster of this dask.distributed scheduler, instead of on this machine. With tcp:// anyone
    who reaches the scheduler runs code on all its machines."""
    tls_ca: Annotated[Path | None, tyro.conf.arg(metavar="FILE.pem")] = None
    """Certificate of the cluster's own authority, for a scheduler at a tls:// address."""
    tls_cert: Annotated[Path | None, tyro.conf.arg(metavar="FILE.pem")] = None
    """Certificate of this machine, signed by that authority."""
    tls_key: Annotated[Path | None, tyro.conf.arg(metavar="FILE.pem")] = None
    """Secret key of this machine."""
    resume: Annotated[Path | None, tyro.conf.arg(metavar="FILE.jsonl")] = None
    """Write each finished cell to this file, and skip the cells that the file already has."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """Write the table to this file, and settings, versions and hashes to FILE.csv.json."""
    parquet: Annotated[Path | None, tyro.conf.arg(metavar="FILE.parquet")] = None
    """Write the table to this file as Parquet, and settings, versions and hashes to FILE.parquet.json."""
    summary: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write all figures to this file, lists included: those of a single run directly, those of several as `runs`."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Draw the question's figure into this file."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Read settings from this file."""

    def __post_init__(self) -> None:
        check_limits(self)
        for name in ("resume", "csv", "parquet", "summary"):
            require_output_file(f"--{name}", getattr(self, name))
        require_output_file("--picture", self.picture, PICTURES)
        self._require_files_of_their_own()
        self.cluster()

    def cluster(self) -> Scheduler | None:
        """Return the scheduler of --scheduler; ValueError for one that cannot be used."""
        if self.scheduler is None:
            return None
        return Scheduler(self.scheduler, self.tls_ca, self.tls_cert, self.tls_key)

    def _require_files_of_their_own(self) -> None:
        taken: dict[Path, str] = {}
        for name in ("resume", "csv", "parquet", "summary", "picture"):
            path: Path | None = getattr(self, name)
            beside = () if path is None or name not in ("csv", "parquet") else (path.with_name(path.name + ".json"),)
            for own in () if path is None else (path, *beside):
                if (other := taken.setdefault(own.resolve(), name)) != name:
                    raise ValueError(f"--{name} {path}: --{other} writes to {own}, too; valid: another file for each")
            if path is not None and name in ("resume", "parquet", "picture") and path.exists() and not path.is_file():
                raise ValueError(f"--{name} {path}: this is no regular file; valid: the path of a regular or new file")


S = TypeVar("S", bound=Sweep)
C = TypeVar("C")


def cell_of(kind: type[C], settings: Sweep) -> C:
    """Return a cell of class `kind` with the values that `settings`, which inherit its fields, have for them."""
    return kind(**{name: getattr(settings, name) for name in kind.__dataclass_fields__})  # type: ignore[attr-defined]


def _nothing(*_: Any) -> tuple[()]:
    return ()


@dataclass(frozen=True)
class Question(Generic[S, C]):
    """One question. Its module defines it as `QUESTION`; the module's docstring begins with the question in words."""

    name: str
    """Command by which it is asked, such as `try approach` or `bench tick`"""
    settings: type[S]
    """Class of the grid's parameters, each of which is a flag; `--help` shows the class's docstring"""
    cells: Callable[[S], Iterable[C]]
    """Function that returns the grid's cells: frozen dataclasses of plain values, whose scalars become columns"""
    run: Callable[[C, int], Iterable[Row]]
    """Function that runs one cell with one seed and returns its rows; all randomness must come from the seed, as by
    `generator`"""
    show: Callable[[S, Table], Iterable[RenderableType]]
    """Function that returns the tables and sentences to print"""
    draw: Callable[[S, Table, Path], object] | None = None
    """Function that draws the figure of `--picture`; None: the question has no figure"""
    goals: Callable[[S, Table], Iterable[Goal]] = _nothing
    """Function that returns the goals: figures with their limits"""
    also: Callable[[S, Table], object] = _nothing
    """Function that writes the files of the question's own flags"""
    frozen: Callable[[S], str] = lambda _: ""
    """Function that returns a hash of the inputs that must not change; figures with the same hash may be compared"""
    failed: Callable[[Row], bool] = lambda _: False
    """Function that returns whether a row is a failure; with any such row the exit code is 1"""
    timed: bool = False
    """Whether cells measure time: they then run one by one in this process, and more workers are refused"""
    prepare: Callable[[], object] = _nothing
    """Function that does in advance what each worker would otherwise repeat, such as compiling kernels"""


def ask(question: Question[Any, Any], arguments: Sequence[str]) -> int:
    """Run a question with the arguments of its command; return 0 if all cells succeeded, 130 after Ctrl-C, else 1."""
    settings = parse_settings(question.settings, f"feelahead {question.name}", arguments)
    if settings.picture is not None and question.draw is None:
        raise ConfigurationError(
            f"--picture {settings.picture}: {question.name} has no figure; valid: without --picture"
        )
    done = sweep(question, settings)
    try:
        _write(question, settings, done)  # before printing, which fails if the reader ends early, as `head` does
    finally:
        _show(question, settings, done)
    if done.ended is not None:
        goes_on = f"to continue, run the same command with --resume {settings.resume}"
        if settings.resume is None:
            goes_on = "a run that is started with --resume FILE.jsonl can be continued"
        sys.stderr.write(f"feelahead {question.name}: {done.ended}; {done.left} runs are left; {goes_on}\n")
    if done.interrupted:
        return _INTERRUPTED
    failed = done.failures or done.ended or any(question.failed(row) for row in done.table)
    return 1 if failed else 0


def _show(question: Question[S, C], settings: S, done: "Swept") -> None:
    """Print the tables and goals of the finished rows, and the failures."""
    console = Console(width=None if sys.stdout.isatty() else _WIDTH, highlight=False, markup=False)
    if len(done.table):
        with _missing_rows(done, "tables"):
            for shown in question.show(settings, done.table):
                console.print(shown)
            show_goals(console, question.goals(settings, done.table))
    for line in done.failures:
        console.print(f"failed: {line}", soft_wrap=True)
    if frozen := question.frozen(settings):
        console.print(f"frozen scenes and limits: {frozen}")


@dataclass(frozen=True)
class Swept:
    """Result of a sweep: the finished rows, the failures, and how the sweep ended."""

    table: Table
    failures: list[str]
    """One line for each piece (cell with seed) that failed"""
    left: int
    """Number of pieces that are neither finished nor failed"""
    ended: str | None = None
    """Reason for an early end; None if all pieces were run"""
    interrupted: bool = False


@contextmanager
def _missing_rows(done: Swept, what: str) -> Iterator[None]:
    """Where pieces are not finished, say that `what` lacks their rows, instead of ending with an error about them."""
    try:
        yield
    except FeelaheadError:
        raise
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        if not done.left and not done.failures:
            raise
        said = f"{type(error).__name__}: {error}".splitlines()[0]
        sys.stderr.write(f"the {what} cannot be made without the rows that are missing ({said:.100})\n")


def sweep(question: Question[S, C], settings: S) -> Swept:
    """Run all pieces that the journal does not have yet, and return all finished rows.

    A cell that raises FeelaheadError fails alone; the others are run. Ctrl-C, a killed worker or a journal that cannot
    be written ends the sweep early, with the rows finished so far. ConfigurationError for a grid that cannot be run.
    """
    if question.timed and (settings.scheduler or settings.workers not in (None, 1)):
        flag = f"--scheduler {settings.scheduler}" if settings.scheduler else f"--workers {settings.workers}"
        raise ConfigurationError(
            f"{flag}: {question.name} measures time, so its cells must run one by one; valid: --workers 1"
        )
    seeds = range(settings.seed, settings.seed + settings.seeds)
    cells = list(question.cells(settings))
    if not 0 < len(cells) * len(seeds) <= _MOST_RUNS:
        valid = f"one value or more of each setting, and at most {_MOST_RUNS} runs"
        raise ConfigurationError(f"{len(cells)} cells with {len(seeds)} seeds each; valid: {valid}")
    order = [Piece(cell, seed) for cell in cells for seed in seeds]
    made_by = {"question": question.name, "code": code_hash(question), "frozen": question.frozen(settings)}
    failures: list[str] = []
    ended, interrupted = None, False
    with Journal(settings.resume, made_by) as journal:
        # All cells with the first seed come first, so that an interrupted sweep has rows of every cell.
        todo = sorted((piece for piece in order if piece.key not in journal.done), key=lambda piece: piece.seed)
        try:
            with progress(question.name, float(len(todo) or 1)) as shown:
                for piece, found in results(question, settings, todo, shown):
                    if isinstance(found, str):
                        failures.append(f"{piece}: {found}")
                    else:
                        journal.keep(piece.key, found)
                    shown.advance(1.0)
        except KeyboardInterrupt:
            interrupted = True
        except ConfigurationError:
            raise
        except FeelaheadError as error:
            ended = str(error)
        rows = [row for piece in order for row in journal.done.get(piece.key, ())]
        left = sum(piece.key not in journal.done for piece in order) - len(failures)
        if interrupted:
            ended = f"interrupted; {len(order) - left} of {len(order)} runs are finished"
    return Swept(Table(rows), failures, left, ended, interrupted)


def generator(cell: object, seed: int) -> np.random.Generator:
    """Return the random generator for one cell and seed; it does not depend on other cells or on the order."""
    digest = hashlib.sha256(Piece(cell, seed).key.encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:16], "little"))


@functools.cache
def _code_hash(own: Path) -> str:
    """Return a hash of the code of feelahead's packages and of the question's own file."""
    digest = hashlib.sha256(own.read_bytes())
    for package in _PACKAGES:
        for path in sorted((_ROOT / package).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def code_hash(question: Question[Any, Any]) -> str:
    """Return a hash of all code on which a question's figures depend."""
    return _code_hash(Path(question.run.__code__.co_filename))


def _write(question: Question[S, C], settings: S, done: Swept) -> None:
    """Write the files that the flags name: summary, tables, picture and the question's own."""
    frozen, table = question.frozen(settings), done.table
    if settings.summary is not None:
        runs = list(table)
        figures = runs[0] if len(runs) == 1 else {"runs": runs}
        write_json("--summary", settings.summary, figures | ({"frozen": frozen} if frozen else {}))
    made_by = provenance(settings, 0, "") | {"question": question.name, "code": code_hash(question), "frozen": frozen}
    for flag, path, write in (
        ("--csv", settings.csv, table.write_csv),
        ("--parquet", settings.parquet, table.write_parquet),
    ):
        if path is not None:
            write(path)
            if path.is_file():
                write_json(flag, path.with_name(path.name + ".json"), made_by)
    with _missing_rows(done, "figure"):
        if settings.picture is not None and question.draw is not None and len(table):
            question.draw(settings, table, settings.picture)
        question.also(settings, table)
