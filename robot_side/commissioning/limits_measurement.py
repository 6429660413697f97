"""Measurement of all joints, one after the other, and its report: a table, and the lines of [arm.limits]."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robot_side.arm.limits import ArmLimits, JointLimits
from robot_side.arm.port import Arm
from robot_side.commissioning.joint_runs import RunsOfJoint
from robot_side.commissioning.procedure import (
    SLIDE_M_PER_RAD,
    Pace,
    ProcedureError,
    StoppedError,
    Watch,
    carry_out,
)
from robot_side.commissioning.response_fit import Figure, JointResponse, fitted

_JERK_UNLESS_TOLD: Final = 1e6
_LIMITS: Final = (
    ("velocity_rad_s", "velocity", "/s"),
    ("acceleration_rad_s2", "speeding up", "/s²"),
    ("deceleration_rad_s2", "slowing down", "/s²"),
)


@dataclass(frozen=True)
class KnownLimits:
    """Limits that count before the measurement, and where each comes from."""

    limits: JointLimits
    settings: ArmLimits
    driver: ArmLimits

    def source(self, name: str) -> str:
        """Return who says the limit of this name."""
        if getattr(self.settings, name) is not None:
            return "the settings"
        return "assumed" if getattr(self.driver, name) is None else "the driver"


@dataclass(frozen=True)
class Measured:
    """One joint's response, or why there is none."""

    name: str
    slides: bool
    response: JointResponse | None
    fault: str | None = None


def question(joints: int, room_rad: float, *, slides: bool) -> str:
    """Return what a person must agree to before anything moves."""
    sliding = f", or {room_rad * SLIDE_M_PER_RAD:.3f} m where it slides" if slides else ""
    return (
        f"each of {joints} joints moves by up to {room_rad:g} rad{sliding}, back and forth, one after the other,"
        " faster and faster, whatever the workspace; see that nothing is in the way, and keep a hand on the emergency"
        " stop"
    )


def measure_limits(
    arm: Arm,
    names: Sequence[str],
    known: KnownLimits,
    pace: Pace,
    room_rad: float,
    oldest_s: float,
    say: Callable[[str], object],
    joints: Sequence[int] | None = None,
) -> Iterator[Measured]:
    """Drive each joint a little; yield what was measured of each, in order. joints: which ones; all if None.

    A joint that does not follow ends with a line, and the next one begins. StoppedError if a person ends it;
    ProcedureError if the arm's states do not let it go on. say: called with one line for each joint.
    """
    slides = np.broadcast_to(known.limits.slides, len(names))
    watch = Watch(known.limits, names, oldest_s)
    for joint, name in enumerate(names):
        if joints is not None and joint not in joints:
            yield Measured(name, bool(slides[joint]), None, "left out")
            continue
        procedure = RunsOfJoint(joint, names, known.limits, room_rad)
        response, fault = None, None
        try:
            response = fitted(carry_out(procedure(), arm, pace, watch))
        except StoppedError:
            raise
        except ProcedureError as error:
            if not procedure.its_own_fault:
                raise
            fault = str(error)
        say(fault or f"joint {joint + 1} ({name}): measured")
        yield Measured(name, bool(slides[joint]), response, fault)


def table(found: Sequence[Measured], known: KnownLimits) -> list[list[str]]:
    """Return the rows of a table, the first one with headings: what, measured, set, and who says so."""
    rows = [["joint", "what", "measured", "set", "from"]]
    for joint, one in enumerate(found):
        if one.response is None:
            rows.append([one.name, one.fault or "not measured", "", "", ""])
            continue
        unit = "m" if one.slides else "rad"
        for name, what, per in _LIMITS:
            # The deceleration after a command's end is another limit than that of a commanded stand.
            of = "acceleration_rad_s2" if name == "deceleration_rad_s2" else name
            values = getattr(known.limits, of)
            measured = _said(getattr(one.response, name))
            rows.append([one.name, f"{what} {unit}{per}", measured, f"{values[joint]:.3g}", known.source(of)])
        jerk, noise = one.response.jerk_rad_s3, one.response.noise_rad
        jerks = known.limits.jerk_rad_s3[joint]
        rows += [
            [
                one.name,
                f"jerk {unit}/s³",
                "too high to be told" if jerk is None else f"{jerk:.3g}",
                "no limit" if math.isinf(jerks) else f"{jerks:.3g}",
                known.source("jerk_rad_s3"),
            ],
            [
                one.name,
                "latency ms",
                f"{1e3 * one.response.latency_s:.0f}",
                f"{1e3 * known.limits.latency_s:.0f}",
                known.source("latency_s"),
            ],
            [one.name, f"noise of a reading m{unit}", f"{1e3 * noise:.2g}", "", ""],
        ]
    return rows


def toml_lines(found: Sequence[Measured], known: KnownLimits) -> list[str]:
    """Return the lines to paste into the file of --config; limits of joints without a measurement stay as they are."""
    responses = [one.response for one in found]
    if all(response is None for response in responses):
        return []

    velocities: list[float] = []
    for response, was in zip(responses, known.limits.velocity_rad_s.tolist(), strict=True):
        # What was not reached is kept where somebody knows it.
        known_faster = known.source("velocity_rad_s") != "assumed"
        if response is None or (response.velocity_rad_s.at_least and known_faster):
            velocities.append(was)
        else:
            velocities.append(_floor(response.velocity_rad_s.value))
    accelerations = [
        was if response is None else _floor(_lower(response))
        for response, was in zip(responses, known.limits.acceleration_rad_s2.tolist(), strict=True)
    ]
    lines = ["[arm.limits]", f"velocity_rad_s = {_list(velocities)}"]
    if any(response is not None and response.velocity_rad_s.at_least for response in responses):
        lines[-1] += "  # not all of it was reached; more room, or the data sheet, tells"
    lines.append(f"acceleration_rad_s2 = {_list(accelerations)}")
    if any(response is not None and response.jerk_rad_s3 is not None for response in responses):
        jerks = [None if response is None else response.jerk_rad_s3 for response in responses]
        lines.append(f"jerk_rad_s3 = {_list([_JERK_UNLESS_TOLD if jerk is None else _floor(jerk) for jerk in jerks])}")
    latest = max(response.latency_s for response in responses if response is not None)
    lines.append(f"latency_s = {math.ceil(1e3 * latest - 0.1) / 1e3:g}")
    return lines


def _lower(response: JointResponse) -> float:
    """Return the lower of both accelerations, as one limit stands for both."""
    return min(response.acceleration_rad_s2.value, response.deceleration_rad_s2.value)


def _said(figure: Figure) -> str:
    return f"at least {figure.value:.3g}" if figure.at_least else f"{figure.value:.3g}"


def _floor(value: float) -> float:
    """Return the value, rounded down to three digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / unit * (1.0 + 1e-12)) * unit


def _list(values: Sequence[float]) -> str:
    return f"[{', '.join(f'{value:.3g}' if value < 1e3 else f'{value:.0f}.0' for value in values)}]"
