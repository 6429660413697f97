"""One run of the demo: both sides as processes, from their flags to their end."""

import contextlib
import sys
import time
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from common.command.status import Status
from common.command.stop_signal import StopSignal
from common.status.codes import LinkState
from common.status.statuses import OperatorStatus, RobotStatus
from feelahead.both_sides.processes import SideFailedError, SideProcess, flag_of
from feelahead.commands.demo.page import KeptPage, Lifetime, kept_addresses
from feelahead.commands.demo.settings import DemoSettings
from feelahead.commands.open_browser import show_address
from operator_side.viewing.facts import OperatorFacts

_START_TIMEOUT_S = 600.0
"""Time, in seconds, for which a robot side that starts may say nothing. While it compiles, which takes many minutes on
a very busy machine, it reports every few seconds."""
_LINK_TIMEOUT_S = 30.0
_WITHOUT_PAGES_S = 30.0
"""Duration of a run without pages, in seconds, unless --duration is given"""
_SHARED = ("link", "link_model", "asymmetry", "tick_period", "full_rate", "seed", "realtime")
"""Flags that the demo passes to both sides."""


def run_both(
    settings: DemoSettings,
    given: Collection[str],
    summaries: Mapping[str, Path],
    stop: StopSignal,
    page: KeptPage | None,
    status: Status,
) -> list[str]:
    """Start both sides, show their status until the run is over, and end them; return the errors.

    page: notes whether a page asks for another run.
    """
    status.note("starting both sides")
    with (
        kept_addresses("control", "view") as listening,
        SideProcess("robot_side", "robot", robot_arguments(settings, given, summaries["robot"], listening)) as robot,
    ):
        status.event("started", side="robot", process_id=robot.process_id)
        operator_flags = operator_arguments(settings, given, summaries["operator"], listening, page)
        with SideProcess("operator_side", "operator", operator_flags) as operator:
            status.event("started", side="operator", process_id=operator.process_id)
            errors: list[str] = []
            with contextlib.suppress(BrokenPipeError):  # the reader of our status has ended
                errors = _watch(settings, robot, operator, stop, status, page)
            # Interrupt both at once, so that neither reports the other's end as a fault of the link.
            operator.interrupt()
            robot.interrupt()
            operator.stop()
            robot.stop()
            for side in (operator, robot):
                try:
                    side.check()
                except SideFailedError as failure:
                    if str(failure) not in errors:
                        errors.append(str(failure))
    return errors


def too_slow(settings: DemoSettings) -> str | None:
    """Return an error text if the delay of the given link is too long for the sides to connect in time, else None."""
    link = settings.link_spec()
    there_s, back_s = (link.profile(direction).mean_delay_s() for direction in ("to_robot", "to_operator"))
    if there_s + back_s < _LINK_TIMEOUT_S:
        return None
    return (
        f"--link {settings.link!r}: a message and its answer take {there_s + back_s:g} s;"
        f" valid: below {_LINK_TIMEOUT_S:g} s, the time in which the two sides must find each other"
    )


def robot_arguments(
    settings: DemoSettings, given: Collection[str], summary: Path, listening: Mapping[str, str]
) -> list[str]:
    """Return the robot side's flags; of the demo's flags only those that the user gave: they override its file."""
    # With a file of settings, the file decides whether tuning is permitted.
    config = "--permit-tuning" if settings.robot_config is None else f"--config={settings.robot_config}"
    watched = ["--cameras.at-once"] if settings.has_pages else []
    of_law = "probability", "assist", "law", "law_paper_share", "enlargement"
    own = _flags(settings, given, *_SHARED, "scene", "perception", "model", "site", "site_axis", *of_law)
    ports = f"--bind={listening['control']}", f"--view-bind={listening['view']}"
    return [*_files(settings, summary), *ports, config, *watched, *own]


def operator_arguments(
    settings: DemoSettings,
    given: Collection[str],
    summary: Path,
    listening: Mapping[str, str],
    page: KeptPage | None = None,
) -> list[str]:
    """Return the operator side's flags; of the demo's flags only those that the user gave: they override its file."""
    arguments = [*_files(settings, summary), "--device=simulated"]
    if settings.operator_config is not None:
        arguments.append(f"--config={settings.operator_config}")
    arguments += [f"--connect={listening['control']}", f"--view-connect={listening['view']}"]
    if settings.tui or settings.status == "facts":
        arguments.append("--status=facts")
    always = (*given, "console", "console_port")
    flags = _flags(settings, always, *_SHARED, "console", "console_port", "compensation", "haptics", "person_file")
    return [*arguments, *flags, *(() if page is None else page.flags(waits=_duration_s(settings) is None))]


def _files(settings: DemoSettings, summary: Path) -> list[str]:
    """Return the flags for a side's output files; both sides' events go to one recorder."""
    recorded = [] if settings.record is None else [f"--record={summary.with_name('recorder')}"]
    return [*recorded, f"--summary={summary}"]


def _flags(settings: DemoSettings, given: Collection[str], *names: str) -> Iterator[str]:
    """Yield flags for those of `names` that the user gave; for all others the sides' configuration files decide."""
    for name in names:
        if name in given:
            yield flag_of(name, getattr(settings, name))


def _watch(
    settings: DemoSettings,
    robot: SideProcess,
    operator: SideProcess,
    stop: StopSignal,
    status: Status,
    page: KeptPage | None = None,
) -> list[str]:
    """Show both sides' status until the run is over; return the errors.

    The run is over when its time is up, Ctrl-C comes, a side ends, or a page asks for another run.
    """
    said, start, lifetime = Said(), Start(settings.link, time.monotonic()), Lifetime(_duration_s(settings))
    while not stop.is_set:
        now_s = time.monotonic()
        for side in (robot, operator):
            take_events(side, said, status, page)
            if not side.running:
                try:
                    side.check()
                except SideFailedError as error:
                    return [str(error)]
                return [f"the {side.name} side ended early"]
        if page is not None and page.wants_again:
            break
        if not lifetime.has_begun:
            if said.operator is not None and said.operator.link is LinkState.UP:
                lifetime.begin(now_s)
            elif (trouble := start.trouble(said, now_s)) is not None:
                return [trouble]
        elif (why := lifetime.why_over(said.pages_since(), now_s)) is not None:
            status.note(why)
            break
        if said.operator is not None:
            status.show(now_s, robot=said.robot, operator=said.operator)
        time.sleep(0.02)
    return []


def _duration_s(settings: DemoSettings) -> float | None:
    """Return the run's duration in seconds; None if it lasts as long as a page is open."""
    if settings.duration is not None:
        return settings.duration
    return None if settings.has_pages and sys.stdout.isatty() else _WITHOUT_PAGES_S


@dataclass
class Said:
    """Reports of both sides until now."""

    robot: RobotStatus | None = None
    operator: OperatorStatus | None = None
    listens: bool = False
    """Whether the robot side listens for an operator side"""
    notes_of_robot: int = 0
    """Number of lines of text from the robot side"""
    pages: int = 0
    """Number of open pages of the console"""
    most_pages: int = 0
    """Greatest number of open pages since the last `pages_since`"""

    def pages_since(self) -> int:
        """Return the greatest number of open pages since the last call: a page may open and close in between."""
        most, self.most_pages = self.most_pages, self.pages
        return most


@dataclass
class Start:
    """Time limits of a start: until the robot side listens, it must go on reporting; then both must find each other."""

    link: str
    heard_s: float
    """Time of the robot side's newest line of text"""
    heard: int = 0
    both_report_s: float | None = None
    """Time since which both sides report: a slow start of a process is no fault of the link"""

    def trouble(self, said: Said, now_s: float) -> str | None:
        """Return why the start has failed; None as long as it has not."""
        if said.listens and said.operator is not None:
            self.both_report_s = now_s if self.both_report_s is None else self.both_report_s
            if now_s - self.both_report_s <= _LINK_TIMEOUT_S:
                return None
            asked = f"; the reason may be --link {self.link!r}" if self.link else ""
            return f"the sides did not find each other within {_LINK_TIMEOUT_S:g} s{asked}"
        if said.notes_of_robot > self.heard:
            self.heard_s, self.heard = now_s, said.notes_of_robot
        if now_s - self.heard_s <= _START_TIMEOUT_S:
            return None
        return f"the sides have not started, and the robot side has said nothing for {_START_TIMEOUT_S:g} s"


def take_events(side: SideProcess, said: Said, status: Status, page: KeptPage | None) -> None:
    """Store in `said` and `page` what `side` has reported since the last call, and show its notes."""
    for event in side.events():
        if event["event"] == "status" and side.name == "robot":
            said.robot = msgspec.convert(event, RobotStatus)
        elif event["event"] == "status":
            said.operator = msgspec.convert(event, OperatorStatus)
        elif event["event"] == "facts":
            facts = msgspec.convert(event["facts"], OperatorFacts)
            status.show_facts(msgspec.structs.replace(facts, robot=said.robot))
        elif event["event"] == "console":
            # A page that stays open during a restart connects again by itself.
            if page is None or page.is_new(str(event["address"])):
                show_address(str(event["address"]), status)
        elif event["event"] == "listening":
            said.listens = True
        elif event["event"] == "pages":
            said.pages = int(event["count"])
            said.most_pages = max(said.most_pages, said.pages)
        elif event["event"] == "again" and page is not None:
            page.wants_again = True
        else:
            said.notes_of_robot += side.name == "robot"
            _show_note(side, event, status)


def _show_note(side: SideProcess, event: Mapping[str, Any], status: Status) -> None:
    if event["event"] == "note":
        status.note(f"{side.name}: {event['text']}")
