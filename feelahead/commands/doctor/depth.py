"""`feelahead doctor --depth`: what depth cameras see, before anybody relies on them."""

import dataclasses
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta
from rich.console import Console

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from feelahead.commands.doctor.arm import finding_of, say, say_aside, show, without_bare
from feelahead.commands.doctor.finding import Finding, Verdict
from robot_side.commissioning.arm_alone import arm_alone
from robot_side.commissioning.depth_checks import depth_checks
from robot_side.commissioning.depth_watch import posed_robot, watch_depth
from robot_side.commissioning.mount_check import mount_check
from robot_side.depth.camera_settings import BY_DEPTH
from robot_side.settings import RobotSettings


@dataclass(frozen=True)
class DepthDoctorSettings(RobotSettings):
    """Look at the pictures of depth cameras for some seconds (docs/depth.md). No arm is moved.

    Each camera gets six lines: pictures, age, holes, range, mount and rods. With --arm the mount is judged by where the
    arm's readings say that it is. All flags of feelahead-robot that describe arm and cameras are valid.
    """

    seconds: Annotated[float, Meta(ge=1.0, le=600.0)] = 5.0
    """Time for which pictures are looked at, from the first one on."""
    solve: str | None = None
    """Name of a camera whose mount is solved by what it sees of the robot; you move the arm by its own pendant."""
    json: bool = False
    """Print the findings as JSON, for programs."""


def check_depth(arguments: Sequence[str]) -> int:
    """Look at the pictures, and print the findings; return the exit code: 0 if nothing is wrong."""
    settings = parse_settings(DepthDoctorSettings, "feelahead doctor", without_bare("--depth", arguments))
    if settings.depth is None and settings.perception != BY_DEPTH:
        valid = "--depth tcp://HOST:PORT, [depth] address in the --config file, or --perception depth"
        raise ConfigurationError(f"no depth camera is named; valid: {valid}")
    if settings.depth is None and settings.arm is not None:
        raise ConfigurationError("--arm and --perception depth exclude each other; valid: --arm and --depth")
    tell = say_aside if settings.json else say
    findings: list[Finding] = []
    # What would perceive by these pictures is not needed.
    bare = dataclasses.replace(settings, perception=None)
    with arm_alone(bare, tell, with_depth=True) as one:
        watched = watch_depth(one, settings.seconds, tell, poses=settings.solve is not None)
    arm_known, lines = settings.arm is not None or settings.depth is None, None
    for name, pictures in sorted(watched.figures.items()):
        checks = list(depth_checks(name, pictures, settings.seconds, settings, arm_known=arm_known))
        if name == settings.solve:
            robot = posed_robot(one)
            solved, lines = mount_check(name, watched.looks[name], watched.mounted[name], robot, arm_known=arm_known)
            # The believed mount is what is to be replaced.
            checks = [check for check in checks if check.name != f"{name}: mount"] + [solved]
        findings += [finding_of(check) for check in checks]
    if watched.refused:
        said = ", ".join(f"{count} {why}" for why, count in watched.refused.items())
        findings.append(Finding("refused pictures", Verdict.MISSING, said, "the lines above; docs/drivers.md"))
    if settings.solve is not None and settings.solve not in watched.figures and watched.figures:
        said = f"no picture of it came; valid: {', '.join(sorted(watched.figures))}"
        findings.append(Finding(f"{settings.solve}: solved mount", Verdict.MISSING, said, "--solve NAME"))
    if not watched.figures:
        remedy = "start the camera's process, and say this address to it (docs/drivers.md)"
        findings.append(Finding("pictures", Verdict.MISSING, "none could be used", remedy))
    if settings.json:
        found = [dataclasses.asdict(finding) for finding in findings]
        sys.stdout.write(json.dumps({"findings": found, "mount": lines}, indent=2) + "\n")
    else:
        console = Console(file=sys.stdout, highlight=False)
        for finding in findings:
            show(console, finding)
        if lines is not None:
            sys.stdout.write(f"\n{lines}\n")
    return 1 if any(finding.verdict is Verdict.MISSING for finding in findings) else 0
