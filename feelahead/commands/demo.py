"""`feelahead demo`: both sides as two processes on loopback, with a simulated controller and person."""

import contextlib
import sys
import tempfile
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import tyro
from msgspec import Meta

from common.command.command_line import given_fields, parse_settings
from common.command.run_options import RunOptions
from common.command.status import Status
from common.command.stop_signal import StopSignal
from common.emulation.figures import report_lines
from common.emulation.spec import Direction, Stream, unused_clauses
from common.errors import ConfigurationError
from common.files.output_file import write_json
from common.limits import check_limits
from common.protocol.messages import Compensation
from common.recording.side import Recorder
from common.status.codes import LinkState
from common.status.statuses import OperatorStatus, RobotStatus
from feelahead.both_sides.processes import SideFailedError, SideProcess
from feelahead.both_sides.summary import merge_summaries, read_summary
from feelahead.commands.open_browser import show_address
from operator_side.viewing.facts import OperatorFacts
from operator_side.viewing.terminal.status import TerminalStatus
from robot_side.laws.named import LawName

_START_TIMEOUT_S = 600.0
"""Time limit of a start, in seconds: the first one compiles kernels, which takes minutes on a busy machine."""
_LINK_TIMEOUT_S = 30.0
_SENT: tuple[tuple[Direction, Stream], ...] = (
    ("to_robot", "haptics"),
    ("to_operator", "haptics"),
    ("to_operator", "telemetry"),
)
"""Streams between the two sides."""
_SHARED = ("link", "link_model", "asymmetry", "full_rate", "seed", "realtime")
"""Flags of both sides."""
_ELSEWHERE = "; each side's keys have a separate file: --robot-config FILE.toml, --operator-config FILE.toml"


@dataclass(frozen=True)
class DemoSettings(RunOptions):
    """Both sides on this machine: a simulated arm, a simulated DualSense, and a scripted person.

    The person arms the arm and pulls R2 to advance towards the target. They feel the trigger stiffen near objects.
    Then they grasp the target, lift it, and set it down again. Nothing is needed but this machine.

    Try: feelahead demo --link "delay 50ms 10ms distribution normal", and the same with --no-haptics.
    """

    scene: Literal["table", "wall", "slot", "shelf"] | None = None
    """Objects around the built-in arm's target. table: a cluttered table (default). wall: a wall 10 to 60 mm behind it.
    slot: two posts in front of it, 15 to 40 mm to spare on each side. shelf: a shelf with a raised front edge to reach
    over. The last three are drawn from the seed."""
    duration: Annotated[float | None, tyro.conf.arg(metavar="SECONDS")] = 30.0
    """Duration of the run with the link up."""
    probability: Annotated[float, tyro.conf.arg(metavar="P")] = 0.99
    """Share of contacts that a warning must precede, between 0 and 1 (eq. 10)."""
    assist: Literal["none", "speed"] = "none"
    """speed: the robot side caps the speed along the triggers, so that the arm stops where full strength begins."""
    law: LawName = "swept"
    """Law of the stiffness. swept: early enough to release, along each trigger; paper: the paper's plain law."""
    compensation: Compensation = "operator"
    """Side that compensates the delay: operator, by the commands under way; robot, by v t_d (eq. 8)."""
    haptics: bool = True
    """Whether the triggers are stiffened; without, the same person only sees."""
    model: Annotated[Path | None, tyro.conf.arg(metavar="FILE.xml")] = None
    """MJCF arm with actuators, instead of the built-in one."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Site of the model between the fingertips, with the z axis along the approach."""
    site_axis: Literal["x", "-x", "y", "-y", "z", "-z"] = "z"
    """Axis of the site along which R2 advances. The start names the one that fits the fingers, if another does."""
    realtime: bool = False
    """Real-time scheduling and locked memory for both sides, if permitted."""
    console: bool = True
    """Browser console, at an address that is shown; from a terminal with a display it opens by itself."""
    console_port: Annotated[int, Meta(ge=0, le=65535), tyro.conf.arg(metavar="PORT")] = 0
    """Port of the console's page on this machine; 0: any free one."""
    tui: bool = False
    """Full-screen terminal instead of a line, for machines without a browser."""
    robot_config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """More settings for the robot side: see feelahead-robot --help."""
    operator_config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """More settings for the operator side: see feelahead-operator --help."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)
        if self.tui and self.status != "line":
            raise ValueError(f"--tui with --status {self.status}; valid: one of them")
        if self.scene is not None and self.model is not None:
            raise ValueError(f"--scene {self.scene} with --model: valid: one of them; a model brings its own scene")


def demo(arguments: Sequence[str]) -> int:
    """Run the demo; exit code 0 also after Ctrl-C, 1 if a side failed during the run."""
    settings = parse_settings(DemoSettings, "feelahead demo", arguments, _ELSEWHERE)
    if (complaint := _too_slow(settings)) is not None:
        raise ConfigurationError(complaint)
    given = given_fields(arguments, DemoSettings)
    errors: list[str] = []
    try:
        with TerminalStatus("feelahead demo") if settings.tui else Status(settings.status, "feelahead demo") as status:
            with tempfile.TemporaryDirectory(prefix="feelahead-") as folder, StopSignal() as stop:
                for text in unused_clauses(settings.link_spec(), _SENT):
                    status.note(text)
                recorder = None if settings.record is None else Recorder(settings.record, Path(folder) / "recorder")
                summaries = {side: Path(folder) / f"{side}.json" for side in ("robot", "operator")}
                with contextlib.suppress(BrokenPipeError):
                    errors = _run_both(settings, given, summaries, stop, status)
                merged = merge_summaries(read_summary(summaries["robot"]), read_summary(summaries["operator"]), errors)
                if recorder is not None:
                    merged["recording"] = merged.get("recording", {}) | recorder.finish()
            # Before the report, which waits for a reader.
            if settings.summary is not None:
                write_json("--summary", settings.summary, merged)
        for line in [*_report(merged), *report_lines(merged.get("link", {}))]:
            status.note(line)
    finally:
        for error in errors:
            sys.stderr.write(f"feelahead demo: {error}\n")
    return 1 if errors else 0


def _run_both(
    settings: DemoSettings, given: Collection[str], summaries: Mapping[str, Path], stop: StopSignal, status: Status
) -> list[str]:
    """Start both sides, watch them, and end them; return the errors."""
    status.note("starting the robot side")
    with SideProcess("robot_side", "robot", _robot_arguments(settings, given, summaries["robot"])) as robot:
        status.event("started", side="robot", process_id=robot.process_id)
        listening = robot.wait_unless(
            "listening", _START_TIMEOUT_S, stop, lambda event: _show_note(robot, event, status)
        )
        if listening is None:
            return []
        operator_arguments = _operator_arguments(settings, given, summaries["operator"], listening)
        with SideProcess("operator_side", "operator", operator_arguments) as operator:
            status.event("started", side="operator", process_id=operator.process_id)
            errors: list[str] = []
            with contextlib.suppress(BrokenPipeError):  # the reader of our status has ended
                errors = _watch(settings, robot, operator, stop, status)
            # Both at once: neither must take the other's end for a link fault.
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


def _too_slow(settings: DemoSettings) -> str | None:
    """Return why the sides cannot find each other in time over the given link; None if they can."""
    link = settings.link_spec()
    there_s, back_s = (link.profile(direction).mean_delay_s() for direction in ("to_robot", "to_operator"))
    if there_s + back_s < _LINK_TIMEOUT_S:
        return None
    return (
        f"--link {settings.link!r}: a message and its answer take {there_s + back_s:g} s;"
        f" valid: below {_LINK_TIMEOUT_S:g} s, within which the two sides must find each other"
    )


def _robot_arguments(settings: DemoSettings, given: Collection[str], summary: Path) -> list[str]:
    # A file decides by itself.
    config = "--permit-tuning" if settings.robot_config is None else f"--config={settings.robot_config}"
    own = _flags(settings, given, *_SHARED, "scene", "model", "site", "site_axis", "probability", "assist", "law")
    return [*_files(settings, summary), "--bind=tcp://127.0.0.1:0", config, *own]


def _operator_arguments(
    settings: DemoSettings, given: Collection[str], summary: Path, listening: dict[str, Any]
) -> list[str]:
    arguments = [*_files(settings, summary), "--device=simulated"]
    if settings.operator_config is not None:
        arguments.append(f"--config={settings.operator_config}")
    arguments += [f"--connect={listening['control']}", f"--view-connect={listening['view']}"]
    if settings.tui or settings.status == "facts":
        arguments.append("--status=facts")
    always = (*given, "console", "console_port")
    return [*arguments, *_flags(settings, always, *_SHARED, "console", "console_port", "compensation", "haptics")]


def _files(settings: DemoSettings, summary: Path) -> list[str]:
    """Return the flags of a side's output files; one recorder listens to both."""
    recorded = [] if settings.record is None else [f"--record={summary.with_name('recorder')}"]
    return [*recorded, f"--summary={summary}"]


def _flags(settings: DemoSettings, given: Collection[str], *names: str) -> Iterator[str]:
    """Yield the given flags; for all others the sides' files count."""
    for name in names:
        if name in given:
            flag, value = name.replace("_", "-"), getattr(settings, name)
            switch = f"--{flag}" if value else f"--no-{flag}"
            yield switch if isinstance(value, bool) else f"--{flag}={value}"


def _watch(
    settings: DemoSettings, robot: SideProcess, operator: SideProcess, stop: StopSignal, status: Status
) -> list[str]:
    """Show both sides' status until the time is over, Ctrl-C, or a side's end; return the errors."""
    waiting_since_s, linked_s = 0.0, None
    said = _Said()
    while not stop.is_set:
        now_s = time.monotonic()
        for side in (robot, operator):
            _take_events(side, said, status)
            if not side.running:
                try:
                    side.check()
                except SideFailedError as error:
                    return [str(error)]
                return [f"the {side.name} side ended early"]
        if linked_s is None:
            if said.operator is None:
                # A busy machine may start a process slowly, which is no fault of the link.
                waiting_since_s = now_s
            elif said.operator.link is LinkState.UP:
                linked_s = now_s
            elif now_s - waiting_since_s > _LINK_TIMEOUT_S:
                asked = f"; the link that was asked for may be why: --link {settings.link!r}" if settings.link else ""
                return [f"the sides did not find each other within {_LINK_TIMEOUT_S:g} s{asked}"]
        elif settings.duration is not None and now_s - linked_s >= settings.duration:
            break
        if said.operator is not None:
            status.show(now_s, robot=said.robot, operator=said.operator)
        time.sleep(0.02)
    return []


@dataclass
class _Said:
    """Newest status of each side."""

    robot: RobotStatus | None = None
    operator: OperatorStatus | None = None


def _take_events(side: SideProcess, said: _Said, status: Status) -> None:
    """Keep the newest status of `side`, and show its notes."""
    for event in side.events():
        if event["event"] == "status" and side.name == "robot":
            said.robot = msgspec.convert(event, RobotStatus)
        elif event["event"] == "status":
            said.operator = msgspec.convert(event, OperatorStatus)
        elif event["event"] == "facts":
            facts = msgspec.convert(event["facts"], OperatorFacts)
            status.show_facts(msgspec.structs.replace(facts, robot=said.robot))
        elif event["event"] == "console":
            show_address(str(event["address"]), status)
        else:
            _show_note(side, event, status)


def _show_note(side: SideProcess, event: Mapping[str, Any], status: Status) -> None:
    if event["event"] == "note":
        status.note(f"{side.name}: {event['text']}")


def _report(summary: dict[str, Any]) -> list[str]:
    """Return a few lines on the run for people."""
    if not summary.get("ticks"):
        return ["nothing to report: the robot side left no figures"]
    delays = summary.get("delay_ms", {})
    shown = [
        f"{name.replace('_', ' ')} {delay['mean']:.1f} ± {delay['sd']:.1f} ms"
        for name, delay in delays.items()
        if delay.get("mean") is not None and delay.get("sd") is not None
    ]
    kept = summary.get("recording")
    recorded = [] if kept is None else [f"recorded: {kept['kept_s']:.1f} s, {kept['bytes'] / 1e6:.1f} MB"]
    task, stiffness, enlargement = summary["task"], summary["stiffness"], summary["enlargement_mm"]
    grasp = "not grasped" if task["time_to_grasp_s"] is None else f"grasped after {task['time_to_grasp_s']:.1f} s"
    grown = "unknown" if enlargement["min"] is None else f"{enlargement['min']:.0f} to {enlargement['max']:.0f} mm"
    placing = task["placing"]
    return [
        f"delay: {', '.join(shown) or 'unknown'}",
        f"stiffness: R2 up to {stiffness['r2']['max']:.2f}, L2 up to {stiffness['l2']['max']:.2f}; enlargement {grown}",
        f"target: {grasp}, lifted {task['lifted_mm']:.0f} mm, {_placed(placing)}",
        f"contacts with obstacles: {task['obstacle_contacts']}",
        *recorded,
    ]


def _placed(placing: Mapping[str, Any]) -> str:
    """Describe how the target was set down."""
    if not placing["placed"]:
        return "not placed"
    felt = "not felt before it was touched"
    if placing["felt_before_s"] is not None:
        felt = f"felt {placing['felt_before_s']:.1f} s and {placing['felt_before_mm']:.0f} mm before it was touched"
    how = f"placed after {placing['time_s']:.1f} s at {placing['contact_speed_mm_s']:.0f} mm/s"
    return f"{how}; what it stands on was {felt}"
