"""`feelahead doctor`: what is missing on this machine, and the command that mends it."""

import dataclasses
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.table import Table
from rich.text import Text

from common.command.command_line import parse_settings
from feelahead.commands.doctor import facts
from feelahead.commands.doctor.controller_checks import (
    ControllerSeen,
    check_controllers,
    check_hidapi,
    check_permission,
    check_uhid,
)
from feelahead.commands.doctor.finding import Finding, Verdict, fit_for_demo
from feelahead.commands.doctor.machine_checks import check_ports, check_realtime
from feelahead.commands.doctor.python_checks import check_extra, check_python

_COLOURS: Final = {Verdict.OK: "green", Verdict.NOTE: "yellow", Verdict.MISSING: "red"}
_WIDTH_WITHOUT_TERMINAL: Final = 120


@dataclass(frozen=True)
class DoctorSettings:
    """What is missing on this machine, and the command that mends it.

    Ends with code 0 when everything is there that `feelahead demo` needs, else with 1. "note" is what works
    without, "missing" is what does not work as it is.
    """

    json: bool = False
    """One JSON object for programs."""


def doctor(arguments: Sequence[str]) -> int:
    """Look, judge and tell."""
    settings = parse_settings(DoctorSettings, "feelahead doctor", arguments)
    controllers = facts.controllers_seen()
    findings = examine(controllers)
    fit = fit_for_demo(findings)
    if settings.json:
        told = {
            "demo": fit,
            "findings": [dataclasses.asdict(finding) for finding in findings],
            "controllers": None if controllers is None else [dataclasses.asdict(seen) for seen in controllers],
        }
        sys.stdout.write(json.dumps(told, indent=2) + "\n")
    else:
        show(findings, Console(width=None if sys.stdout.isatty() else _WIDTH_WITHOUT_TERMINAL))
    return 0 if fit else 1


def examine(controllers: list[ControllerSeen] | None) -> list[Finding]:
    """Every check of this machine, in the order of the table."""
    version = sys.version_info
    return [
        check_python((version.major, version.minor, version.micro)),
        *(check_extra(extra, failures) for extra, failures in facts.failed_imports().items()),
        check_hidapi(sys.platform, facts.hid_facts()),
        check_permission(
            sys.platform, is_root=facts.is_root(), rules=facts.udev_rules(), controllers=controllers or []
        ),
        *check_controllers(controllers),
        check_uhid(sys.platform, facts.uhid_facts()),
        *check_realtime(sys.platform, facts.realtime_notes()),
        *check_ports(facts.port_troubles()),
    ]


def show(findings: list[Finding], console: Console) -> None:
    """A table, and below it what to do, unwrapped so that it can be copied."""
    table = Table(title="feelahead doctor")
    table.add_column("what")
    table.add_column("")
    table.add_column("how it stands", overflow="fold")
    for finding in findings:
        table.add_row(finding.name, Text(finding.verdict.value, _COLOURS[finding.verdict]), Text(finding.said))
    console.print(table)
    remedies = [finding for finding in findings if finding.remedy is not None]
    for finding in remedies:
        console.print(Text(f"{finding.name}:", _COLOURS[finding.verdict]))
        console.print(finding.remedy, markup=False, highlight=False, soft_wrap=True)
    fit = fit_for_demo(findings)
    console.print("The demo can run: feelahead demo" if fit else "The demo cannot run as it is: see what is missing.")
