"""`feelahead-robot --measure-limits`: what the arm really does, as a table and as lines for the file of --config."""

import sys
from typing import Final

import numpy as np
from rich.console import Console
from rich.table import Table

from robot_side.commissioning.arm_alone import arm_alone
from robot_side.commissioning.limits_measurement import (
    KnownLimits,
    Measured,
    measure_limits,
    question,
    table,
    toml_lines,
)
from robot_side.settings import RobotSettings

_WIDTH_WITHOUT_TERMINAL: Final = 120


def measure(settings: RobotSettings) -> int:
    """Measure every joint and print the result; return the exit code: 0 if all could be measured.

    Raises ProcedureError if the arm's states, or a person, end it.
    """
    with arm_alone(settings, _say) as one:
        room_rad = settings.measure_room_rad
        if not one.simulated:
            slides = bool(np.any(one.known.limits.slides))
            _say(question(len(one.joint_names), room_rad, slides=slides))
            if settings.measure_limits != "yes" and one.answer("type yes to begin:") != "yes":
                _say("nothing was moved")
                return 1
        found: list[Measured] = []
        names, known, oldest_s = one.joint_names, one.known, settings.safety.arm_s
        try:
            found.extend(measure_limits(one.arm, names, known, one.pace, room_rad, oldest_s, _say))
        finally:
            if found:
                _show(found, known)
    return 1 if any(joint.response is None for joint in found) else 0


def _show(found: list[Measured], known: KnownLimits) -> None:
    shown = Table(title="what the arm does")
    head, *rows = table(found, known)
    for text in head:
        shown.add_column(text)
    for row in rows:
        shown.add_row(*row)
    Console(width=None if sys.stdout.isatty() else _WIDTH_WITHOUT_TERMINAL).print(shown)
    if len(found) == known.limits.velocity_rad_s.size and (lines := toml_lines(found, known)):
        _say("for the file of --config:\n")
        _say("\n".join(lines))


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()
