"""`feelahead demo`: both sides as two processes on loopback, with a simulated controller and person."""

import contextlib
import math
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from common.command.command_line import given_fields, parse_settings
from common.command.status import Status
from common.command.stop_signal import StopSignal
from common.emulation.figures import report_lines
from common.emulation.spec import Direction, Stream, unused_clauses
from common.errors import ConfigurationError
from common.extras import require_packages
from common.files.output_file import write_json
from common.recording.side import RecorderProcess
from feelahead.both_sides.settings_files import check_settings_files
from feelahead.both_sides.summary import merge_summaries, read_summary
from feelahead.commands.demo.compare import compare
from feelahead.commands.demo.page import KeptPage
from feelahead.commands.demo.run import run_both, too_slow
from feelahead.commands.demo.settings import DemoSettings
from operator_side.people.simulated_hands import own_person
from operator_side.viewing.terminal.status import TerminalStatus
from robot_side.laws.named import find_law

_SENT: tuple[tuple[Direction, Stream], ...] = (
    ("to_robot", "haptics"),
    ("to_operator", "haptics"),
    ("to_operator", "telemetry"),
)
"""Streams between the two sides."""
_ELSEWHERE = "; each side's keys have a separate file: --robot-config FILE.toml, --operator-config FILE.toml"


def demo(arguments: Sequence[str]) -> int:
    """Run the demo; return 1 if a side failed during the run, else 0, also after Ctrl-C."""
    settings = parse_settings(DemoSettings, "feelahead demo", arguments, _ELSEWHERE)
    if (complaint := too_slow(settings)) is not None:
        raise ConfigurationError(complaint)
    check_settings_files(settings.robot_config, settings.operator_config)
    given = given_fields(arguments, DemoSettings)
    if settings.compare:
        return compare(settings, given)
    _check_parts(settings)
    errors: list[str] = []
    try:
        with TerminalStatus("feelahead demo") if settings.tui else Status(settings.status, "feelahead demo") as status:
            with tempfile.TemporaryDirectory(prefix="feelahead-") as folder, StopSignal() as stop:
                for text in unused_clauses(settings.link_spec(), _SENT):
                    status.note(text)
                recorder = (
                    None if settings.record is None else RecorderProcess(settings.record, Path(folder) / "recorder")
                )
                summaries = {side: Path(folder) / f"{side}.json" for side in ("robot", "operator")}
                page = KeptPage(Path(folder)) if settings.has_pages and settings.record is None else None
                with contextlib.suppress(BrokenPipeError):
                    errors = run_both(settings, given, summaries, stop, page, status)
                    while page is not None and page.take_again() and not errors:
                        errors = run_both(settings, given, summaries, stop, page, status)
                merged = merge_summaries(read_summary(summaries["robot"]), read_summary(summaries["operator"]), errors)
                if recorder is not None:
                    merged["recording"] = merged.get("recording", {}) | recorder.finish()
                    if (why := merged["recording"]["error"]) is not None:
                        errors.append(f"the recording is not whole: {why}")
            # Before the report, whose output may block until somebody reads it.
            if settings.summary is not None:
                write_json("--summary", settings.summary, merged)
        for line in [*_report(merged), *report_lines(merged.get("link", {}))]:
            status.note(line)
    finally:
        for error in errors:
            sys.stderr.write(f"feelahead demo: {error}\n")
    return 1 if errors else 0


def _check_parts(settings: DemoSettings) -> None:
    """Raise ConfigurationError for what a side would refuse later: a missing package, a law, person or model."""
    require_packages("demo", "mujoco", "numba", extra="robot")
    find_law(settings.law)
    if settings.person_file is not None:
        own_person(settings.person_file)
    if settings.model is not None:
        from robot_side.drivers.mujoco.brought.trial import try_model  # noqa: PLC0415  # MuJoCo is slow to import

        try_model(settings.model.resolve())


def _report(summary: dict[str, Any]) -> list[str]:
    """Return the lines that report the run to the person at the terminal."""
    if not summary.get("ticks"):
        return ["no results: the robot side ended before it had written any"]
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
        *left_out(summary.get("skipped", {})),
        *recorded,
    ]


_NOT_NEEDED: Final = {
    "pairs of sphere and primitive": ("pairs",),
    "looks": ("looks",),
    "pictures": ("pictures",),
    "messages": ("stiffness_messages", "motion_messages"),
    "writes": ("writes",),
    "kernels": ("kernels",),
}
"""What the last line names, and the entries of the summary's `skipped` that it adds up"""


def left_out(skipped: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return the line that says what was not done, in whole percent, rounded down; none if nothing is known."""
    said = []
    for words, names in _NOT_NEEDED.items():
        found = [skipped[name] for name in names if name in skipped]
        if found:
            done, whole = (sum(one[key] for one in found) for key in ("done", "of"))
            said.append(f"{math.floor(100.0 * (1.0 - done / whole))} % of the {words}")
    return [f"not done, because it was not needed: {', '.join(said)}"] if said else []


def _placed(placing: Mapping[str, Any]) -> str:
    """Describe in words how the target was set down."""
    if not placing["placed"]:
        return "not placed"
    felt = "not felt before it was touched"
    if placing["felt_before_s"] is not None:
        felt = f"felt {placing['felt_before_s']:.1f} s and {placing['felt_before_mm']:.0f} mm before it was touched"
    how = f"placed after {placing['time_s']:.1f} s at {placing['contact_speed_mm_s']:.0f} mm/s"
    return f"{how}; what it stands on was {felt}"
