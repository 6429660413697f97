"""`feelahead bench dualsense`: our driver beside pydualsense, on the same simulated reports."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from feelahead.benchmarks.dualsense.conduct import Conduct, Driver
from feelahead.benchmarks.dualsense.ours import Ours
from feelahead.benchmarks.dualsense.peer import PyDualSense
from feelahead.benchmarks.report import Goal, Table, markdown, show, show_goals
from feelahead.documents.generated_part import with_generated_part
from operator_side.dualsense.reports.transport import Transport

PROGRAM = "feelahead bench dualsense"
_WIDE = 120


@dataclass(frozen=True)
class DualSenseBenchSettings:
    """Our DualSense driver and pydualsense, on the same simulated controller.

    Both read the same input reports, of USB and of Bluetooth, and what they write is kept. No controller is needed.
    """

    rounds: Annotated[int, tyro.conf.arg(metavar="N")] = 20
    """Each time is the best of so many."""
    write_docs: Annotated[Path | None, tyro.conf.arg(metavar="FILE.md")] = None
    """Put the table between the marks of this document."""

    def __post_init__(self) -> None:
        if self.write_docs is not None and not self.write_docs.is_file():
            raise ValueError(f"--write-docs {self.write_docs}: valid: a document with marks for the generated part")
        if not 1 <= self.rounds <= 10_000:
            raise ValueError(f"--rounds {self.rounds}: valid: 1 to 10000")


def bench_dualsense(arguments: Sequence[str]) -> int:
    """Run the benchmark; exit code 0 whether or not the goals are met."""
    settings = parse_settings(DualSenseBenchSettings, PROGRAM, arguments)
    console = Console() if Console().is_terminal else Console(width=_WIDE)
    drivers: list[Driver] = [Ours(), PyDualSense()]
    conducts = [driver.examine(settings.rounds) for driver in drivers]
    shown = table([driver.name for driver in drivers], conducts)
    show(console, shown)
    show_goals(console, goals(conducts))
    if settings.write_docs is not None:
        _write(settings.write_docs, shown)
    return 0


def table(names: Sequence[str], conducts: Sequence[Conduct]) -> Table:
    """What is compared, a column for each driver."""

    def row(what: str, tell: Callable[[Conduct], str]) -> tuple[str, ...]:
        return (what, *(tell(conduct) for conduct in conducts))

    rows = [
        *(row(f"{one.value}: time for one input report, us", _parse_time(one)) for one in Transport),
        *(row(f"{one.value}: gyroscope and accelerometer right", _axes_right(one)) for one in Transport),
        *(row(f"{one.value}: touch point right", _touch_right(one)) for one in Transport),
        row("Bluetooth: refuses a report with a wrong checksum", lambda one: _yes(one.corrupted_refused)),
        row("writes a second at rest, 250 reports a second", lambda one: f"{one.writes_at_rest_per_s:.0f}"),
        row("leaves lights, mute key and sound to the system", lambda one: _yes(not one.foreign_flags)),
        row("triggers released when closed", lambda one: _yes(one.released_at_close)),
        row("debug effect codes can be sent", lambda one: _yes(one.debug_codes)),
        row("unplugged in mid-run", lambda one: one.after_unplug),
    ]
    return Table("The same reports, two drivers", ("", *names), rows)


def _parse_time(transport: Transport) -> Callable[[Conduct], str]:
    return lambda conduct: f"{1e6 * conduct.parse_s[transport]:.1f}"


def _axes_right(transport: Transport) -> Callable[[Conduct], str]:
    return lambda conduct: _yes(conduct.axes_right[transport])


def _touch_right(transport: Transport) -> Callable[[Conduct], str]:
    return lambda conduct: _yes(conduct.touch_right[transport])


def _yes(answer: bool) -> str:
    return "yes" if answer else "no"


def goals(conducts: Sequence[Conduct]) -> list[Goal]:
    """What ours is to reach beside the other."""
    ours, theirs = conducts
    return [
        *(
            Goal(f"{one.value}: time of ours / theirs", ours.parse_s[one] / theirs.parse_s[one], 1.0)
            for one in Transport
        ),
        Goal("writes a second at rest", ours.writes_at_rest_per_s, 0.0),
    ]


def _write(path: Path, shown: Table) -> None:
    try:
        document = path.read_text(encoding="utf-8")
        path.write_text(with_generated_part(document, markdown(shown)), encoding="utf-8")
    except (OSError, ValueError) as error:
        said = error.strerror if isinstance(error, OSError) else error
        raise ConfigurationError(f"--write-docs {path}: {said}") from error
