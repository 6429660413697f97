"""Reason, in words, why the scripted person did not place the target: where they were, and what kept the arm still."""

import math
from collections.abc import Mapping
from typing import Any

from common.command.words import words
from common.status.codes import Doing
from feelahead.both_sides.loopback import Loopback
from operator_side.people.person import SimulatedOperator


def why_not_placed(
    run: Loopback, person: SimulatedOperator, placing: Mapping[str, Any], *, armed: bool, grasped: bool
) -> str | None:
    """Return why the target was not placed by now; None if it was.

    placing: `Placing.summary`. armed, grasped: whether the arm was armed, and the target grasped, at any time.
    """
    if placing["placed"]:
        return None
    safety = run.robot.session.safety
    said = [_where(run, person, grasped=grasped) if armed else "the arm was never armed"]
    if grasped and placing["tilt_deg"] is not None:
        gap_mm, tilt_deg = max(0.0, placing["off_support_mm"]), placing["tilt_deg"]
        said.append(f"at the end it is {gap_mm:.0f} mm above a support, tilted by {tilt_deg:.0f}°")
    if safety.state != "armed" and safety.still_because is not None:
        said.append(f"{safety.state}: {safety.still_because}")
    if (hindrance := run.robot.motion.hindrance.text) is not None:
        said.append(f"the arm does not follow: {hindrance}")
    return "; ".join(said)


def _where(run: Loopback, person: SimulatedOperator, *, grasped: bool) -> str:
    doing, screen = person.doing, run.operator.screen
    if doing is Doing.NO_TARGET:
        return "no object is a target, so there is nothing to advance to"
    ended = "gave up" if doing is Doing.DONE else f"time ran out while {words(doing)}"
    if grasped:
        return f"{ended} after a grasp"
    centre_m = None if screen is None else screen.target_in_tool_m
    if centre_m is None:
        return f"{ended}, the target unseen"
    aside_mm, ahead_mm = 1e3 * math.hypot(*centre_m[:2]), 1e3 * centre_m[2]
    where = f"the target {aside_mm:.0f} mm beside the tool's axis and {abs(ahead_mm):.0f} mm"
    return f"{ended} without a grasp, {where} {'ahead' if ahead_mm >= 0.0 else 'behind'}"
