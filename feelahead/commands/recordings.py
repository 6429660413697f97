"""`feelahead replay`, `export` and `plot`: what can be done with a recording."""

import struct
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from common.command.command_line import parse_settings
from common.errors import ConfigurationError, FeelaheadError
from common.recording.packages import require_packages
from common.recording.reading import Recording, open_recording

_BOTH_SIDES = "pip install 'feelahead[robot,operator,record]'"


@dataclass(frozen=True)
class ReplaySettings:
    """Show a recording in the console, or compute its cores anew.

    Try: feelahead demo --record run.mcap, then feelahead replay run.mcap --check.
    """

    file: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.mcap")] = None
    """The recording."""
    check: bool = False
    """Compute every stiffness, command and report to the controller anew from the recorded inputs, and compare. Exit
    code 1 where they differ by more than another processor may: 1 of 8 in strength, 1e-12 m in ways."""
    speed: float = 1.0
    """How many times as fast as it was to show it."""
    tui: bool = False
    """On the whole terminal, instead of the console's page."""
    console_port: int = 0
    """Where the page is on this machine; 0: any port that is free."""

    def __post_init__(self) -> None:
        if not 0.01 <= self.speed <= 1000.0:
            raise ValueError(f"--speed {self.speed}: valid: 0.01 to 1000")
        if not 0 <= self.console_port <= 65535:
            raise ValueError(f"--console-port {self.console_port}: valid: 0 to 65535")


@dataclass(frozen=True)
class ExportSettings:
    """Turn a recording into files that other programs read.

    csv, parquet: a folder with a file for each topic at its own rate, and one of everything joined at 100 Hz.
    lerobot: a LeRobot dataset, v3.0, of one episode at 30 Hz. mcap: what is whole of a file that was cut off.
    """

    file: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.mcap")] = None
    """The recording."""
    format: Literal["csv", "parquet", "lerobot", "mcap"] = "csv"
    """What to make of it."""
    out: Path | None = None
    """Where: a folder that is not there yet or empty, or for mcap a file; unless given, beside the recording, named
    after it."""


@dataclass(frozen=True)
class PlotSettings:
    """Draw a run on one page."""

    file: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.mcap")] = None
    """The recording."""
    out: Path | None = None
    """Where: a file that ends in .png, .svg or .pdf; beside the recording as .png unless given."""


def _open(path: Path | None) -> Recording:
    if path is None:
        raise ConfigurationError("no recording given; valid: the path of a file that --record made")
    recording = open_recording(path)
    if recording.readable is not None or not recording.whole:
        why = "is damaged" if recording.readable is not None else "was cut off"
        sys.stderr.write(f"feelahead: {path}: {why}; what can be read of it: {recording.length_s():.1f} s\n")
    return recording


@contextmanager
def _recording(path: Path | None) -> Iterator[Recording]:
    """A recording to work with: whatever cannot be made of its content is one line."""
    recording = _open(path)
    try:
        yield recording
    except (FeelaheadError, OSError):
        raise
    except (ArithmeticError, AttributeError, LookupError, MemoryError, TypeError, ValueError, struct.error) as error:
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        raise ConfigurationError(f"{path}: holds what no recording of ours does ({what:.200})") from error


def replay(arguments: Sequence[str]) -> int:
    """Show or check."""
    settings = parse_settings(ReplaySettings, "feelahead replay", arguments)
    with _recording(settings.file) as recording:
        return _replay(settings, recording)


def _replay(settings: ReplaySettings, recording: Recording) -> int:
    if settings.check:
        return _check(recording)
    from feelahead.commands.replay_player import play_in_terminal, play_on_page  # noqa: PLC0415

    if settings.tui:
        return play_in_terminal(recording, settings.speed)
    return play_on_page(recording, settings.speed, settings.console_port)


def _check(recording: Recording) -> int:
    try:
        from feelahead.recordings.replay import replay_operator, replay_robot  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise ConfigurationError(f"replay: {error.name} is not installed; {_BOTH_SIDES}") from error
    within, made = True, 0
    for side, make in (("robot", replay_robot), ("operator", replay_operator)):
        if side in recording.headers:
            compared = make(recording)
            within &= compared.within
            made += compared.made
            sys.stdout.write("\n".join(compared.lines()) + "\n")
    if not made:
        sys.stdout.write("nothing was compared: it holds nothing to make anew\n")
        return 1
    sys.stdout.write("the same, within what is promised\n" if within else "NOT the same\n")
    return 0 if within else 1


def export(arguments: Sequence[str]) -> int:
    """Write the files."""
    settings = parse_settings(ExportSettings, "feelahead export", arguments)
    with _recording(settings.file) as recording:
        return _export(settings, recording)


def _export(settings: ExportSettings, recording: Recording) -> int:
    if settings.format == "mcap":
        from common.recording.mending import mend  # noqa: PLC0415

        out = settings.out or recording.path.with_name(f"{recording.path.stem}-whole.mcap")
        sys.stdout.write(f"{out}: {mend(recording.path, out)} messages\n")
        return 0
    if settings.format in ("parquet", "lerobot"):
        require_packages(f"--format {settings.format}", "pyarrow", extra="experiments")
    folder = _empty_folder(settings.out or recording.path.with_name(f"{recording.path.stem}-{settings.format}"))
    from feelahead.recordings.tables import read_tables  # noqa: PLC0415

    tables = read_tables(recording)
    if settings.format == "lerobot":
        from feelahead.recordings.lerobot import export_lerobot  # noqa: PLC0415

        count = export_lerobot(recording, tables, folder)
        sys.stdout.write(f"{folder}: 1 episode, {count} frames\n")
        return 0
    from feelahead.recordings.export_tables import export_csv, export_parquet  # noqa: PLC0415

    written = (export_csv if settings.format == "csv" else export_parquet)(tables, folder)
    sys.stdout.write(f"{folder}: {', '.join(written)}\n")
    return 0


def _empty_folder(path: Path) -> Path:
    try:
        path.mkdir(exist_ok=True)
        empty = not any(path.iterdir())
    except OSError as error:
        raise ConfigurationError(f"--out {path}: {error.strerror}; valid: a folder, new or empty") from error
    if not empty:
        raise ConfigurationError(f"--out {path}: is not empty; valid: a folder, new or empty")
    return path


def plot(arguments: Sequence[str]) -> int:
    """Draw the page."""
    settings = parse_settings(PlotSettings, "feelahead plot", arguments)
    with _recording(settings.file) as recording:
        return _plot(settings, recording)


def _plot(settings: PlotSettings, recording: Recording) -> int:
    out = recording.path.with_suffix(".png") if settings.out is None else settings.out
    if out.suffix not in (".png", ".svg", ".pdf"):
        raise ConfigurationError(f"--out {out}: valid: a file that ends in .png, .svg or .pdf")
    if not out.absolute().parent.is_dir():
        raise ConfigurationError(f"--out {out}: its folder is not there; valid: a file's path")
    require_packages("plot", "matplotlib", extra="experiments")
    from feelahead.recordings.plot import plot_run  # noqa: PLC0415
    from feelahead.recordings.tables import read_tables  # noqa: PLC0415

    plot_run(recording, read_tables(recording), out)
    sys.stdout.write(f"{out}\n")
    return 0
