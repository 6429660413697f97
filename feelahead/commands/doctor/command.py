"""`feelahead doctor`: find what is missing on this machine or wrong on the path to a robot side."""

import dataclasses
import json
import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro
from rich.console import Console
from rich.table import Table
from rich.text import Text

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from common.files.plugged import Installed, installed
from common.sockets.authentication import OperatorKeys
from feelahead.commands.doctor import controllers, link, machine
from feelahead.commands.doctor.finding import COLOURS, Finding, Verdict, can_be
from feelahead.commands.doctor.path import measure_path, path_line
from feelahead.commands.doctor.port import RobotAddress
from robot_side.laws.named import LAWS

_WIDTH_WITHOUT_TERMINAL: Final = 120


@dataclass(frozen=True)
class DoctorSettings:
    """Report what is missing on this machine, and the command that mends it.

    The exit code is 0 if this machine can run the robot side (and so the demo) or the operator side, else 1. "note"
    marks something optional, "missing" something that does not work.

    With --connect: check the path to a robot side instead. With exit code 1 the first fault and its remedy are
    reported; with 0, the round trip and whether another operator has the arm. Then the path is measured for five
    seconds: delay, queue, losses, and what the path is good enough for (the arm, one view, both views). Meanwhile the
    doctor holds the arm, disarmed, if it is free, and otherwise observes. An operator who drives notices nothing. The
    machines' wall clocks need not agree.

    With --arm: go through the checklist before the first motion of your arm, whose driver connects there. Each joint
    moves by 2 degrees and back. All flags of feelahead-robot that describe the arm are valid; the address may be in the
    --config file. See: feelahead doctor --arm --help, and docs/real-arm.md.

    With --depth or --perception depth: look at the pictures of depth cameras for some seconds. The report says how many
    come, their age, their holes, whether the mount fits the arm, and how thin a rod is felt. Exit code 1 if one is bad.
    See: feelahead doctor --depth --help, and docs/depth.md.

    With --compile: compile the kernels of all scenes for this machine's processor now, instead of at the first start.
    This takes half a minute or more. The machine code is kept in $NUMBA_CACHE_DIR, else in
    ~/.cache/feelahead/kernels; kernels that are already there stay. Exit code 1 if the folder cannot be written.
    """

    json: bool = False
    """Print the result as one JSON object, for programs."""
    compile: bool = False
    """Compile the robot side's kernels now."""
    arm: Annotated[str | None, tyro.conf.arg(metavar="[tcp://HOST:PORT]")] = None
    """Go through the checklist of an arm whose driver connects at this address."""
    depth: Annotated[str | None, tyro.conf.arg(metavar="[tcp://HOST:PORT]")] = None
    """Look at the pictures of a process that connects at this address."""
    perception: Annotated[str | None, tyro.conf.arg(metavar="depth")] = None
    """depth: look at the pictures of the simulated depth cameras."""
    connect: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Check the path to a robot side at this address."""
    path: bool = True
    """With --connect: also measure the path for five seconds."""
    view_connect: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address of the robot side's view port; unless given, the port after the control port."""
    keys: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Folder with the operator's key, as for feelahead-operator."""
    robot_key: Annotated[str | None, tyro.conf.arg(metavar="KEY|FILE")] = None
    """Public key of the robot side; needs --keys."""

    def __post_init__(self) -> None:
        for name in ("view_connect", "keys", "robot_key"):
            if getattr(self, name) is not None and self.connect is None:
                raise ValueError(f"--{name.replace('_', '-')} is given without --connect; valid: both, or neither")
        if self.compile and self.connect is not None:
            raise ValueError("--compile and --connect exclude each other; valid: only one of them")
        if self.robot_key is not None and self.keys is None:
            raise ValueError("--robot-key is given without --keys; valid: both, or neither")


def doctor(arguments: Sequence[str]) -> int:
    """Run the checks that the arguments ask for, and print the result; return the exit code."""
    given = {argument.partition("=")[0] for argument in arguments}
    if asked := [flag for flag in ("--depth", "--perception", "--arm") if flag in given]:
        if missing := machine.failed_imports("robot"):
            raise ConfigurationError(f"{asked[0]} needs the extra robot, which lacks {', '.join(missing)}")
        if asked != ["--arm"]:
            from feelahead.commands.doctor.depth import check_depth  # noqa: PLC0415  # it has no MuJoCo

            return check_depth(arguments)
        from feelahead.commands.doctor.arm import check_arm  # noqa: PLC0415  # an operator machine has no MuJoCo

        return check_arm(arguments)
    settings = parse_settings(DoctorSettings, "feelahead doctor", arguments)
    if settings.connect is not None:
        return _look_along(settings, settings.connect)
    if settings.compile:
        return machine.compile_kernels(as_json=settings.json)
    findings = examine()
    robot, operator = can_be("robot", findings), can_be("operator", findings)
    if settings.json:
        found = {"demo": robot, "operator": operator, "findings": [dataclasses.asdict(finding) for finding in findings]}
        sys.stdout.write(json.dumps(found, indent=2) + "\n")
    else:
        show(findings, Console(width=None if sys.stdout.isatty() else _WIDTH_WITHOUT_TERMINAL))
    return 0 if robot or operator else 1


def _look_along(settings: DoctorSettings, connect: str) -> int:
    keys = None if settings.keys is None else OperatorKeys.load(settings.keys, settings.robot_key)
    address = RobotAddress.to(connect, settings.view_connect, keys)
    talk, error = link.check_path(address)
    path = measure_path(address) if settings.path and error is None else None
    if settings.json:
        said = json.dumps(link.as_json(address, talk, error) | ({} if path is None else {"path": path}), indent=2)
    elif error is not None:
        said = str(error)
    else:
        said = link.reached(talk) + ("" if path is None else f"\n{path_line(path)}")
    sys.stdout.write(said + "\n")
    return 0 if error is None else 1


def examine() -> list[Finding]:
    """Run every check of this machine; return the findings in the order in which they are shown."""
    seen = controllers.controllers_seen()
    absent = machine.failed_imports("robot")
    rules, is_root = controllers.udev_rules(), hasattr(os, "geteuid") and os.geteuid() == 0
    return [
        Finding("Python", Verdict.OK, platform.python_version()),
        *(machine.check_extra(extra, machine.failed_imports(extra)) for extra in machine.EXTRAS),
        controllers.check_permission(is_root=is_root, rules=rules, controllers=seen),
        *seen,
        *controllers.gamepads_seen(),
        *machine.check_kernels(machine.kernel_facts()),
        *([machine.check_rendering(machine.rendering_troubles())] if "mujoco" not in absent else []),
        *machine.check_realtime(machine.realtime_notes()),
        *(_plugged(part) for part in installed({"law": LAWS})),
    ]


def _plugged(part: Installed) -> Finding:
    """Return the finding of a part that an installed package registers."""
    what = f"{part.kind} {part.name}"
    if part.fault is None:
        return Finding(what, Verdict.OK, f"of {part.package}")
    remedy = f"mend or remove the package: pip uninstall {part.package.partition(' ')[0]}"
    return Finding(what, Verdict.NOTE, f"left out: {part.package}: {part.fault}", remedy)


def show(findings: list[Finding], console: Console) -> None:
    """Print a table of the findings, and below it the remedies, without line breaks so that they can be copied."""
    table = Table(title="feelahead doctor")
    table.add_column("what")
    table.add_column("")
    table.add_column("state", overflow="fold")
    for finding in findings:
        table.add_row(finding.name, Text(finding.verdict.value, COLOURS[finding.verdict]), Text(finding.said))
    console.print(table)
    remedies = [finding for finding in findings if finding.remedy is not None]
    for finding in remedies:
        console.print(Text(f"{finding.name}:", COLOURS[finding.verdict]))
        console.print(finding.remedy, markup=False, highlight=False, soft_wrap=True)
    if can_be("robot", findings):
        console.print("The demo can run: feelahead demo")
    elif can_be("operator", findings):
        console.print("This machine can be the operator side: feelahead-operator. The demo needs the extra robot, too.")
    else:
        console.print("Neither side can run as it is: see what is missing.")
