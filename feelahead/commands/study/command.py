"""`feelahead study`: run a study, check its protocol, plan it, report on it."""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tyro
from msgspec import Meta
from rich.console import Console, RenderableType

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from common.extras import installing
from common.limits import Limited
from feelahead.printing.figures import shown
from feelahead.study.balance import ANSWER_S, delay_places, follows, most_minutes, places, whole_square
from feelahead.study.folder import Study
from feelahead.study.protocol import Protocol, load_protocol
from feelahead.study.schedule import schedule
from feelahead.study.steps import public

_Protocol = Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="PROTOCOL.toml")]
_Given = TypeVar("_Given")


@dataclass(frozen=True)
class StudySettings(Limited):
    """Run a study: who does what in which order stands in a protocol, as examples/study.toml.

    From a protocol to a report:
      feelahead study check PROTOCOL.toml: balance of the orders, minutes a participant.
      feelahead study plan PROTOCOL.toml: text to preregister, and how many participants it takes.
      feelahead study PROTOCOL.toml --out DIR: run it. Whatever ends it, the same command goes on, and nothing is lost.
      feelahead study report DIR: the page with every figure, from the recordings anew.
    """

    protocol: _Protocol = None
    """Protocol of the study."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Folder of the study, new, empty, or begun with the same protocol."""
    simulated: Annotated[Annotated[int, Meta(ge=1, le=999)] | None, tyro.conf.arg(metavar="N")] = None
    """Let this many simulated persons take part, in virtual time, instead of people."""
    participant: Annotated[Annotated[int, Meta(ge=1, le=999)] | None, tyro.conf.arg(metavar="N")] = None
    """Number of the participant who is here. It can also be chosen on the experimenter's page."""
    workers: Annotated[int, tyro.conf.arg(metavar="N"), Meta(ge=1, le=256)] = 1
    """With --simulated: number of processes; the figures do not depend on it."""


@dataclass(frozen=True)
class CheckSettings:
    """Print how balanced the orders of a protocol are, and how long a participant takes at most."""

    protocol: _Protocol = None
    """Protocol of the study."""


@dataclass(frozen=True)
class PlanSettings:
    """Print a text to preregister; with --pool, also how probable it is that each effect is found, by participants.

    Try: feelahead study PROTOCOL.toml --simulated 24 --out POOL, then feelahead study plan PROTOCOL.toml --pool POOL
    """

    protocol: _Protocol = None
    """Protocol of the study."""
    pool: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Folder of a study with simulated persons, from whom participants are drawn. Its protocol has the same conditions,
    contrasts, delays, scenes, trials and limit."""


@dataclass(frozen=True)
class ReportSettings:
    """Make tables and the page of a study from its recordings and its journal anew."""

    folder: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="DIR")] = None
    """Folder of the study."""


def study(arguments: Sequence[str]) -> int:
    """Run the action that the first argument names, or the study of the protocol that it is."""
    match arguments:
        case ["check", *rest]:
            asked = parse_settings(CheckSettings, "feelahead study check", rest)
            _print(_checked(load_protocol(_given(asked.protocol, "PROTOCOL.toml"))))
        case ["plan", *rest]:
            _plan(parse_settings(PlanSettings, "feelahead study plan", rest))
        case ["report", *rest]:
            folder = _given(parse_settings(ReportSettings, "feelahead study report", rest).folder, "DIR")
            tables = _late("feelahead.study.report.reading").read_tables(folder)
            sys.stdout.write(f"{_late('feelahead.study.report.writing').write_report(tables, folder)}\n")
        case _:
            _run(parse_settings(StudySettings, "feelahead study", arguments))
    return 0


def _run(settings: StudySettings) -> None:
    protocol = _given(settings.protocol, "PROTOCOL.toml")
    if not protocol.is_file():
        raise ConfigurationError(f"study {protocol}: no such action or file; valid: check, plan, report or a protocol")
    folder = _given(settings.out, "--out DIR")
    with Study(folder, protocol) as opened:
        if settings.simulated is not None:
            _late("feelahead.study.trials.simulated").run_simulated(opened, settings.simulated, settings.workers)
        _print(iter([_progress(opened)]))
        if settings.simulated is None:
            _late("feelahead.commands.study.people").run_people(opened, settings.participant)


def _plan(settings: PlanSettings) -> None:
    protocol = load_protocol(_given(settings.protocol, "PROTOCOL.toml"))
    planned = None
    if settings.pool is not None:
        power = _late("feelahead.study.report.power")
        pool = _late("feelahead.study.report.reading").read_tables(settings.pool)
        power.require_pool(protocol, pool)
        planned = power.plan(pool)
    sys.stdout.write(_late("feelahead.study.report.preregistration").preregistration(protocol, planned))


def _checked(protocol: Protocol) -> Iterator[RenderableType]:
    names, number = list(protocol.conditions), protocol.participants
    at, after = places(protocol), follows(protocol)
    columns = range(1, len(names) + 1)
    yield f"Of {number} participants, how many meet a condition at each place:"
    yield shown(
        "",
        ["condition", *map(str, columns)],
        [[name, *(at.get((name, place), 0) for place in columns)] for name in names],
    )
    yield "How many meet a condition directly after another:"
    yield shown(
        "",
        ["condition", *(f"after {name}" for name in names)],
        [[name, *(None if name == one else after.get((one, name), 0) for one in names)] for name in names],
    )
    square = whole_square(protocol)
    if number % square:
        near = sorted({max(square, number - number % square), number + square - number % square})
        yield f"Not balanced: {number} is no multiple of {square}; valid: {' or '.join(map(str, near))} participants."
    else:
        yield f"Balanced: {number} participants are a multiple of {square}."
    fewest, most = delay_places(protocol)
    yield f"Each delay stands {fewest} to {most} times at each place under each condition."
    minutes = most_minutes(protocol)
    yield f"A participant has {len(schedule(protocol, 1))} trials. At most, with {ANSWER_S:g} s for each question:"
    yield shown(
        "",
        ["part", "minutes"],
        [*minutes.items(), ("all", sum(minutes.values()))],
    )


def _progress(opened: Study) -> RenderableType:
    rows = []
    for number in opened.journal.participants:
        progress = opened.journal.progress(number)
        faults = sum(one.status != "complete" for one in progress.attempts)
        step = public(opened.next_step(number))["step"]
        rows.append((str(number), len(progress.complete), faults, step))
    return shown(f"{opened.protocol.name}: participants", ["number", "trials done", "faults", "comes next"], rows)


def _print(parts: Iterator[RenderableType]) -> None:
    console = Console()
    for part in parts:
        console.print(part)


def _given(value: _Given | None, name: str) -> _Given:
    if value is None:
        raise ConfigurationError(f"study: no {name} given; valid: see feelahead study --help")
    return value


def _late(module: str) -> Any:
    """Return a module that needs more packages than this command."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            f"study: {error.name} is not installed; to install it: {installing('robot,operator,record,study')}"
        ) from error
