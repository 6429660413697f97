"""One approach: a finger of constant force pulls R2, both sides and the link in virtual time. Does it hit?"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from common.arrays import FloatArray, IntArray
from common.emulation.clauses import LinkModel
from common.errors import FeelaheadError
from feelahead.approaches.laws import Compensation, Law, stiffness_settings
from feelahead.approaches.pulling_hands import PullingHands
from feelahead.approaches.pulls import Pull, constant_force
from feelahead.approaches.spoilt import Spoil, controller
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from operator_side.dualsense.effects.official import MAX_STRENGTH
from operator_side.settings import OperatorSettings
from robot_side.settings import CameraSettings, RobotSettings
from robot_side.simulation.scene import load_scene
from robot_side.simulation.true_contact import ContactOnset, TrueContact

SAMPLE_S = 0.01
"""Speed, gap and zones are noted this often."""
STANDS_M_S = 0.001
"""Slower than this for the last second, the gripper has stopped."""
SWING_M_S = 0.015
"""A change of speed that counts when reversals are counted."""
_LAST_S = 1.0
_LONGEST_ARMING_S = 30.0

End = Literal["contact", "stopped", "undecided"]


@dataclass(frozen=True)
class Approach:
    """What is done; the seed draws the camera's, the encoders' and the link's errors."""

    model: Path
    force_n: float
    site: str = "tool"
    strongest_n: float = 2.0
    """The force that the strongest effect adds (an assumption: no trigger has been measured)."""
    link: str = ""
    link_model: LinkModel = "datagram"
    law: Law = "first"
    compensation: Compensation = "robot"
    probability: float = 0.99
    duration_s: float = 8.0
    """From the beginning of the pull."""
    seed: int = 0
    grip: bool = False
    spoil: Spoil = "nothing"


@dataclass(frozen=True)
class Trace:
    """What happened from the beginning of the pull on, a row each 10 ms."""

    time_s: FloatArray
    """(k,) since the pull began"""
    speed_m_s: FloatArray
    """(k,) of the true tool along its approach axis"""
    gap_m: FloatArray
    """(k,) true, to whatever is nearest"""
    travel: FloatArray
    """(k,) mechanical, of R2, 0 to 1"""
    strengths: IntArray
    """(k, 10) of R2's zones, 0 to 8"""


@dataclass(frozen=True)
class Outcome:
    """How an approach ended."""

    end: End
    contact_speed_mm_s: float | None
    """Closing speed along the true contact's normal at its onset; None without a contact."""
    contact_with: str | None
    least_gap_mm: float
    """True, to whatever is nearest, over the whole pull."""
    stops_at_mm: float | None
    """The true gap at the end, where the gripper was slower than 1 mm/s for the last second; else None."""
    way_left_mm: float | None
    """How far it could still go along its approach axis, from there."""
    reversals: int
    """How often the speed turned from rising to falling or back, by more than 15 mm/s."""
    ended_s: float
    """Since the pull began."""
    trace: Trace = field(repr=False)


@dataclass
class _Samples:
    """A trace in the making."""

    time_s: list[float] = field(default_factory=list)
    speed_m_s: list[float] = field(default_factory=list)
    gap_m: list[float] = field(default_factory=list)
    travel: list[float] = field(default_factory=list)
    strengths: list[tuple[int, ...]] = field(default_factory=list)

    def trace(self) -> Trace:
        return Trace(
            np.array(self.time_s),
            np.array(self.speed_m_s),
            np.array(self.gap_m),
            np.array(self.travel),
            np.array(self.strengths, dtype=np.int64).reshape(-1, 10),
        )


class _Watch:
    """Sees the truth after each turn of the robot side."""

    def __init__(self, truth: TrueContact) -> None:
        self.truth = truth
        self.onset: ContactOnset | None = None
        self.samples = _Samples()
        self.run: Loopback | None = None
        self.hands: PullingHands | None = None
        self._next_s = -math.inf

    def after_robot_tick(self, now_s: float) -> None:
        run, hands = self.run, self.hands
        if run is None or hands is None or self.onset is not None:
            return
        onset = self.truth.update(run.robot.held)
        if hands.pull_began_s is None:
            return
        self.onset = onset
        if now_s >= self._next_s or onset is not None:
            self._next_s = now_s + SAMPLE_S - 1e-9
            self.samples.time_s.append(now_s - hands.pull_began_s)
            self.samples.speed_m_s.append(self.truth.approach()[1])
            self.samples.gap_m.append(self.truth.gap_m(run.robot.held))
            self.samples.travel.append(run.device.travel[1])
            self.samples.strengths.append(run.device.effects[1].zone_strengths)


def run_approach(approach: Approach, pull: Pull | None = None, camera: CameraSettings | None = None) -> Outcome:
    """Run it to its contact, or to its end; the same settings give the same outcome.

    `pull`: instead of R2 pressed with the constant force. ConfigurationError for a model or a link that cannot be
    used; FeelaheadError where the robot is not armed in time.
    """
    robot = RobotSettings(
        model=approach.model,
        site=approach.site,
        link=approach.link,
        link_model=approach.link_model,
        seed=approach.seed,
        probability=approach.probability,
        stiffness=stiffness_settings(approach.law),
        camera=camera or CameraSettings(),
    )
    operator = OperatorSettings(
        link=approach.link, link_model=approach.link_model, seed=approach.seed, haptics=approach.law != "none"
    )
    scene = load_scene(robot.model, robot.site, robot.roles)
    watch = _Watch(TrueContact(scene))
    device = controller(approach.strongest_n / MAX_STRENGTH, approach.spoil)
    hands = PullingHands(device, pull or constant_force(approach.force_n), grip=approach.grip)
    run = Loopback(
        LoopbackSettings(robot, operator),
        scene=scene,
        device=device,
        person=lambda _: hands,
        after_robot_tick=watch.after_robot_tick,
    )
    watch.run, watch.hands = run, hands
    while hands.pull_began_s is None:
        run.run_until(run.clock.now() + SAMPLE_S)
        if run.clock.now() > _LONGEST_ARMING_S:
            raise FeelaheadError(_not_armed(approach, run))
    end_s = hands.pull_began_s + approach.duration_s
    while watch.onset is None and run.clock.now() < end_s:
        run.run_until(min(run.clock.now() + SAMPLE_S, end_s))
    return _outcome(watch, run.robot.held)


def _not_armed(approach: Approach, run: Loopback) -> str:
    stops = run.robot.session.safety.stops
    why = f"; it stopped: {stops[-1][1]}" if stops else ""
    grip = " and did not grip" if approach.grip else ""
    return f"the robot was not armed{grip} within {_LONGEST_ARMING_S:g} s over --link {approach.link!r}{why}"


def _outcome(watch: _Watch, held: str | None) -> Outcome:
    trace = watch.samples.trace()
    onset = watch.onset
    end: End = "contact" if onset is not None else "stopped" if stands(trace) else "undecided"
    stopped = end == "stopped"
    return Outcome(
        end=end,
        contact_speed_mm_s=None if onset is None else 1e3 * onset.closing_speed_m_s,
        contact_with=None if onset is None else onset.thing,
        least_gap_mm=1e3 * float(trace.gap_m.min(initial=math.inf)),
        stops_at_mm=1e3 * float(trace.gap_m[-1]) if stopped else None,
        way_left_mm=1e3 * watch.truth.way_left_m(watch.truth.approach()[0], held) if stopped else None,
        reversals=reversals(trace.speed_m_s.tolist()),
        ended_s=float(trace.time_s[-1]),
        trace=trace,
    )


def stands(trace: Trace) -> bool:
    """Whether the gripper was slower than 1 mm/s throughout the last second."""
    last = trace.time_s > trace.time_s[-1] - _LAST_S
    whole = trace.time_s[-1] - trace.time_s[0] >= _LAST_S - 2.0 * SAMPLE_S
    return bool(whole and (np.abs(trace.speed_m_s[last]) < STANDS_M_S).all())


def reversals(speeds_m_s: Sequence[float], swing_m_s: float = SWING_M_S) -> int:
    """How often the speed turned from rising to falling or from falling to rising, by more than `swing_m_s`.

    It rises at first: an approach that goes on has none, one that slows down once has 1, a limit cycle has many.
    """
    count, sign, extreme = 0, 1.0, -math.inf
    for speed in speeds_m_s:
        if sign * speed >= sign * extreme:
            extreme = speed
        elif sign * (extreme - speed) > swing_m_s:
            count, sign, extreme = count + 1, -sign, speed
    return count
