"""`feelahead replay`, `feelahead export` and `feelahead plot`: the commands that read a recording."""

import struct
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from msgspec import Meta

from common.command.command_line import parse_settings
from common.errors import ConfigurationError, FeelaheadError
from common.extras import installing, require_packages
from common.files.output_file import require_output_file
from common.limits import Limited, check_limits
from common.recording.reading import Recording, open_recording
from common.units import parse_duration
from feelahead.printing.progress import progress
from feelahead.recordings.comparison import Comparison
from feelahead.recordings.playback import require_protocol, require_statuses
from robot_side.laws.named import require_law
from robot_side.laws.paper_settings import PaperFlags

_Speed = Annotated[float, Meta(gt=0.0, le=1000.0)]
_BOTH_SIDES = f"to install it: {installing('robot,operator,record')}"


@dataclass(frozen=True)
class ReplaySettings(Limited):
    """Show a recording in the console; with --check, compute its run again and compare.

    Try: feelahead demo --record run.mcap, then feelahead replay run.mcap --check.
    """

    file: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.mcap")] = None
    """The recording."""
    check: bool = False
    """Compute every stiffness, command and report to the controller again from the recorded inputs, and compare them
    with the recorded ones. Exit code 1 if they differ by more than 1 of 8 in strength or 1e-12 m in distance, the
    differences between processors."""
    speed: Annotated[float, Meta(ge=0.01, le=1000.0)] = 1.0
    """Speed of playing; 1 is the speed of the recorded run."""
    tui: bool = False
    """Show the recording on the full terminal, instead of on the console's page."""
    console_port: Annotated[int, Meta(ge=0, le=65535)] = 0
    """Port of the page on this machine; 0: any free port."""


@dataclass(frozen=True)
class ExportSettings(Limited):
    """Turn a recording into files that other programs read.

    csv, parquet: a folder with a file for each topic at its original rate, and a file `joined` with all topics at
    100 Hz. columns.md beside them says unit, frame and meaning of each column.
    lerobot: a LeRobot dataset, v3.0, at the pictures' own rate, or --fps, cut into the marked episodes. Where the
    package lerobot is installed, it writes the dataset, with pictures as video.
    """

    file: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.mcap")] = None
    """The recording."""
    format: Literal["csv", "parquet", "lerobot"] = "csv"
    """Format of the files."""
    fps: Annotated[int, Meta(ge=1, le=1000)] | None = None
    """Frames a second, for lerobot only; by default the median rate of the pictures, at most 30."""
    out: Path | None = None
    """Folder for the files, new or empty; unless given, a folder beside the recording, named after the recording."""
    columns: bool = False
    """Only print unit, frame and meaning of every column that csv and parquet can have; needs no recording."""


@dataclass(frozen=True)
class PlotSettings(PaperFlags):
    """Draw a run on one page; or, with --law, the strength of laws against the distance to what is ahead.

    Try: feelahead plot --law swept paper ./mine.py --against distance --scene wall --out laws.png
    """

    file: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.mcap")] = None
    """The recording."""
    out: Path | None = None
    """File to write, which ends in .png, .svg or .pdf; unless given, a .png beside the recording, or distance.png."""
    law: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME|FILE.py...")] = ()
    """Laws to draw, instead of a recording: swept, paper, paper-isotropic, or files of your own
    (docs/python.md)."""
    against: Literal["distance"] = "distance"
    """With --law: what the strength under the finger is drawn against."""
    scene: Annotated[Literal["table", "wall", "slot", "shelf"] | None, tyro.conf.arg(metavar="NAME")] = None
    """With --law: scene of the built-in arm, with what lies ahead of its gripper; unless given, the wall."""
    model: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE.xml...")] = ()
    """With --law: MJCF files, each with an arm and things ahead of its tool; a panel for each."""
    site: Annotated[str, tyro.conf.arg(metavar="NAME")] = "tool"
    """Name of the models' site between the fingertips."""
    speeds: Annotated[tuple[_Speed, ...], tyro.conf.arg(metavar="MM/S...")] = (60.0, 240.0)
    """With --law: constant speeds of the gripper along its approach axis."""
    loop_age: Annotated[str, tyro.conf.arg(metavar="TIME")] = "100ms"
    """With --law: loop age t_d, over which the motion is known (eq. 8)."""
    seed: Annotated[int, Meta(ge=0)] = 0
    """With --law: seed of the built-in scene."""

    def __post_init__(self) -> None:
        check_limits(self)
        if self.law and self.file is not None:
            raise ValueError(f"{self.file} and --law exclude each other; valid: a recording, or laws")
        if self.scene is not None and self.model:
            raise ValueError("--scene and --model exclude each other; valid: one of them")
        for law in self.law:
            require_law(law)
        require_output_file("--out", self.out, (".png", ".svg", ".pdf"))


@contextmanager
def _recording(path: Path | None) -> Iterator[Recording]:
    """Open a recording; errors that its content causes become a ConfigurationError of one line."""
    if path is None:
        raise ConfigurationError("no recording given; valid: the path of a file that --record made")
    recording = open_recording(path)
    if recording.damaged or not recording.whole:
        why = "is damaged" if recording.damaged else "was cut off"
        sys.stderr.write(f"feelahead: {path}: {why}; {recording.length_s():.1f} s of it can be read\n")
    try:
        yield recording
    except (FeelaheadError, OSError):
        raise
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        MemoryError,
        RecursionError,
        TypeError,
        ValueError,
        struct.error,
    ) as error:
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        raise ConfigurationError(
            f"{path}: is no valid recording ({what:.200}); valid: a file that --record made"
        ) from error


def replay(arguments: Sequence[str]) -> int:
    """Show or check a recording."""
    settings = parse_settings(ReplaySettings, "feelahead replay", arguments)
    with _recording(settings.file) as recording:
        require_protocol(recording)
        if settings.check:
            return _check(recording)
        require_statuses(recording)
        from feelahead.commands.replay_player import play_in_terminal, play_on_page  # noqa: PLC0415

        if settings.tui:
            return play_in_terminal(recording, settings.speed)
        return play_on_page(recording, settings.speed, settings.console_port)


def _check(recording: Recording) -> int:
    try:
        compared = list(_computed_again(recording))
    except ModuleNotFoundError as error:
        raise ConfigurationError(f"replay --check: {error.name} is not installed; {_BOTH_SIDES}") from error
    said = [line for one in compared for line in one.lines()]
    within = all(one.within for one in compared)
    if not sum(one.made for one in compared):
        said.append("nothing was compared: the recording has no messages that can be computed again")
        within = False
    else:
        said.append("the same, within the promised tolerance" if within else "NOT the same")
    sys.stdout.write("\n".join(said) + "\n")
    return 0 if within else 1


def _computed_again(recording: Recording) -> Iterator[Comparison]:
    """Compute each recorded side again. Each needs what that side needs: a robot's simulation, an operator's none."""
    if "robot" in recording.headers:
        from feelahead.recordings.replay_robot import replay_robot  # noqa: PLC0415

        yield replay_robot(recording)
    if "operator" in recording.headers:
        from feelahead.recordings.replay_operator import replay_operator  # noqa: PLC0415

        yield replay_operator(recording)


def export(arguments: Sequence[str]) -> int:
    """Export a recording."""
    settings = parse_settings(ExportSettings, "feelahead export", arguments)
    if settings.fps is not None and settings.format != "lerobot":
        raise ConfigurationError(f"--fps {settings.fps}: valid with: --format lerobot")
    if settings.columns:
        from feelahead.recordings.dictionary import dictionary, every_table  # noqa: PLC0415

        sys.stdout.write(dictionary(every_table()))
        return 0
    with _recording(settings.file) as recording:
        if settings.format != "csv":
            require_packages(f"--format {settings.format}", "pyarrow", extra="experiments")
        beside = recording.path.with_name(f"{recording.path.stem}-{settings.format}")
        folder = _empty_folder(settings.out or beside)
        said = _export(settings, recording, folder)
    sys.stdout.write(f"{folder}: {said}\n")
    return 0


def _export(settings: ExportSettings, recording: Recording, folder: Path) -> str:
    """Write the files into `folder`; return a description of them in words."""
    from feelahead.recordings.demonstrations import read_demonstrations  # noqa: PLC0415
    from feelahead.recordings.lerobot import export_lerobot  # noqa: PLC0415
    from feelahead.recordings.tables import export_csv, export_parquet, read_tables  # noqa: PLC0415

    tables = read_tables(recording)
    if settings.format == "lerobot":
        frames = read_demonstrations(recording, tables, settings.fps)
        return f"{frames.words()}; {export_lerobot(recording, frames, folder)}"
    return ", ".join((export_csv if settings.format == "csv" else export_parquet)(tables, folder))


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
    """Draw a recorded run on one page."""
    settings = parse_settings(PlotSettings, "feelahead plot", arguments)
    if settings.law:
        return _plot_laws(settings)
    with _recording(settings.file) as recording:
        out = recording.path.with_suffix(".png") if settings.out is None else settings.out
        require_packages("plot", "matplotlib", extra="experiments")
        from feelahead.recordings.plot import plot_run  # noqa: PLC0415
        from feelahead.recordings.tables import read_tables  # noqa: PLC0415

        plot_run(recording, read_tables(recording), out)
    sys.stdout.write(f"{out}\n")
    return 0


def _plot_laws(settings: PlotSettings) -> int:
    require_packages("plot", "matplotlib", extra="experiments")
    try:
        from feelahead.both_sides.against_distance import Course, draw_courses, strength_against_distance  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise ConfigurationError(f"plot --law: {error.name} is not installed; {_BOTH_SIDES}") from error
    places: dict[str, dict[str, Any]] = {
        str(model): {"model": model, "site": settings.site, "seed": settings.seed} for model in settings.model
    } or {settings.scene or "wall": {"scene": settings.scene or "wall", "seed": settings.seed}}
    speeds_m_s = [1e-3 * speed for speed in settings.speeds]
    loop_age_s = parse_duration(settings.loop_age, "--loop-age")
    of_paper: dict[str, Any] = {"law_paper_share": settings.law_paper_share, "enlargement": settings.enlargement}
    courses: dict[str, list[Course]] = {}
    with progress("feelahead plot", float(len(places) * len(settings.law))) as shown:
        for name, place in places.items():
            courses[Path(name).stem] = found = []
            for law in settings.law:
                shown.begin(f"{Path(name).stem}, {law}")
                found += strength_against_distance(law, speeds_m_s, loop_age_s=loop_age_s, **place, **of_paper)
                shown.advance(1.0)
    out = settings.out or Path("distance.png")
    draw_courses(courses, out)
    sys.stdout.write(f"{out}\n")
    return 0
