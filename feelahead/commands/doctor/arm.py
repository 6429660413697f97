"""`feelahead doctor --arm`: the checklist before an operator moves an arm for the first time."""

import dataclasses
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import tyro
from msgspec import Meta
from rich.console import Console
from rich.text import Text

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from feelahead.commands.doctor.finding import COLOURS, Finding, Verdict
from robot_side.commissioning.arm_alone import arm_alone
from robot_side.commissioning.checklist import Check, run_checks
from robot_side.commissioning.procedure import ProcedureError
from robot_side.settings import RobotSettings

_Width = Annotated[float, Meta(gt=0.0, le=1000.0)]


@dataclass(frozen=True)
class ArmDoctorSettings(RobotSettings):
    """Go through the checklist before the first motion of an arm (docs/real-arm.md).

    Each joint moves by 2 degrees and back. All flags of feelahead-robot that describe the arm are valid.
    """

    block_mm: Annotated[_Width | None, tyro.conf.arg(metavar="MM")] = None
    """Width of a block that a person holds between the fingers, on which the gripper closes."""
    yes: bool = False
    """Take every question as answered by yes: nobody looks whether the real arm did what its readings say."""
    json: bool = False
    """Print the findings as JSON, for programs; questions go to standard error."""


def check_arm(arguments: Sequence[str]) -> int:
    """Run the checklist; return the exit code: 0 if nothing is wrong."""
    settings = parse_settings(ArmDoctorSettings, "feelahead doctor", without_bare("--arm", arguments))
    if settings.arm is None:
        raise ConfigurationError("--arm: has no address; valid: tcp://HOST:PORT, or [arm] address in the --config file")
    tell = say_aside if settings.json else say
    findings: list[Finding] = []
    unseen: list[str] = []
    console = Console(file=sys.stdout, highlight=False)
    with arm_alone(settings, tell) as alone:
        one = dataclasses.replace(alone, aside=settings.json)
        tell("each joint moves by 2° (5 mm where it slides) and back; keep a hand on the emergency stop")
        if not settings.yes and one.answer("type yes to begin:") != "yes":
            tell("nothing was moved")
            return 1

        def ask(question: str) -> bool:
            if settings.yes:
                unseen.append(question)
                return True
            return one.answer(f"{question} (yes/no)") in ("yes", "y")

        try:
            for check in run_checks(one, ask, None if settings.block_mm is None else 1e-3 * settings.block_mm):
                findings.append(finding_of(check, "; nobody looked" if unseen else ""))
                unseen.clear()
                if not settings.json:
                    show(console, findings[-1])
        except ProcedureError as error:
            findings.append(Finding("checklist", Verdict.MISSING, f"ended: {error}"))
            if not settings.json:
                show(console, findings[-1])
    if settings.json:
        found = [dataclasses.asdict(finding) for finding in findings]
        sys.stdout.write(json.dumps({"findings": found, "unseen": settings.yes}, indent=2) + "\n")
    return 1 if any(finding.verdict is Verdict.MISSING for finding in findings) else 0


def without_bare(flag: str, arguments: Sequence[str]) -> list[str]:
    """Return the arguments without a flag that has no value: its address is in the --config file."""
    following = [*arguments[1:], "--"]
    bare = [word == flag and after.startswith("--") for word, after in zip(arguments, following, strict=True)]
    return [word for word, has_no_address in zip(arguments, bare, strict=True) if not has_no_address]


def finding_of(check: Check, also: str = "") -> Finding:
    """Return the finding of a check. also: ends what was found."""
    verdict = Verdict.NOTE if check.good is None else Verdict.OK if check.good else Verdict.MISSING
    return Finding(check.name, verdict, check.said + also, check.remedy)


def show(console: Console, finding: Finding) -> None:
    """Print a finding as one line."""
    line = Text(f"{finding.name}: ").append(finding.verdict.value, COLOURS[finding.verdict])
    line.append(f"  {finding.said}" + ("" if finding.remedy is None else f"; look at: {finding.remedy}"))
    console.print(line, soft_wrap=True)


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def say_aside(text: str) -> None:
    """Print a line beside the output."""
    sys.stderr.write(f"{text}\n")
