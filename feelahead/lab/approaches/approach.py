"""Run one approach: a finger pulls R2 with constant force, and both sides and the link run in virtual time."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from common.emulation.clauses import LinkModel
from common.errors import FeelaheadError
from common.periods import TURN
from common.protocol.messages import Vector2
from feelahead.both_sides.episode import Episode
from feelahead.lab.approaches.laws import TriedLaw, compensation_of, law_of_robot
from feelahead.lab.approaches.outcome import SAMPLE_S, End, Outcome, Trace, reversals, stands
from operator_side.controller.feel import MAX_STRENGTH, ZONE_COUNT, Feel
from operator_side.controller.state import ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.people.arming_hands import ArmingHands, constant_force
from operator_side.people.port import Person
from operator_side.settings import OperatorSettings
from robot_side.arm.limits import ArmLimits
from robot_side.compiled.warm_up import import_kernels, warm_up
from robot_side.drivers.mujoco.robot_model import SiteAxis
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.laws.paper_settings import PaperSettings
from robot_side.settings import Assist, CameraSettings, RobotSettings
from robot_side.tick.events import Listener
from robot_side.tick.truth import ContactOnset

_FULL: Final = Feel(l2=(MAX_STRENGTH,) * ZONE_COUNT, r2=(MAX_STRENGTH,) * ZONE_COUNT)


class FullDualSense(SimulatedDualSense):
    """Simulated controller whose triggers always resist with full strength, for the law `full`."""

    def write(self, feel: Feel, now_s: float) -> None:
        """Write full strength, whatever is commanded."""
        del feel
        super().write(_FULL, now_s)

    def read(self, now_s: float) -> ControllerState | None:
        """Return the state; if the triggers are free, set them to full strength."""
        if self.released:
            super().write(_FULL, now_s)
        return super().read(now_s)


@dataclass(frozen=True)
class Approach:
    """Settings of one approach. From the seed the errors of camera and encoders and the link's delays are drawn."""

    model: Path
    force_n: float
    site: str = "tool"
    site_axis: SiteAxis = "z"
    strongest_n: float = 2.0
    """Force in newtons with which the strongest effect resists (assumed: no trigger has been measured)."""
    link: str = ""
    link_model: LinkModel = "datagram"
    law: TriedLaw = "swept"
    paper: PaperSettings = field(default_factory=PaperSettings)
    """Settings of the paper's laws"""
    probability: float = 0.99
    duration_s: float = 8.0
    """Time from the beginning of the pull to the end of the run."""
    seed: int = 0
    grip: bool = False
    stick: Vector2 = (0.0, 0.0)
    """Deflection (right, up) of the left stick, which moves the tool across; its dead zone is subtracted already."""
    turn: Vector2 = (0.0, 0.0)
    """Deflection (right, up) of the right stick, which turns the tool; its dead zone is subtracted already."""
    assist: Assist = "none"
    full_rate: bool = False
    """Whether both sides send every message, as with `--full-rate`."""
    tick_period: str = TURN
    """Period of both sides' turns"""
    camera_sd_m: float | None = None
    """Standard deviation σ_c of the camera's error, in metres; None: the default of the settings."""
    arm_limits: ArmLimits = field(default_factory=ArmLimits)
    """Limits of the arm that both sides know"""
    simulated_limits: ArmLimits | None = None
    """Limits of the simulated arm, if others than those"""


class PullRun(Listener):
    """Both sides, their link and a hand that pulls R2; the run can be advanced in steps."""

    def __init__(
        self, approach: Approach, person: Person | None = None, device: SimulatedDualSense | None = None
    ) -> None:
        """Build both sides in the scene. person: who pulls, instead of the constant force. device: other triggers."""
        self.approach = approach
        self.onset: ContactOnset | None = None
        """First contact since the pull began; None before it."""
        self._rows: list[tuple[float, float, float, float, tuple[int, ...]]] = []
        """Rows of the trace: time, speed, gap, travel and strengths"""
        robot = robot_settings(approach)
        operator = OperatorSettings(
            link=approach.link,
            link_model=approach.link_model,
            seed=approach.seed,
            haptics=approach.law != "none",
            compensation=compensation_of(approach.law),
            full_rate=approach.full_rate,
            tick_period=approach.tick_period,
        )
        kind = FullDualSense if approach.law == "full" else SimulatedDualSense
        device = device or kind(strength_step_n=approach.strongest_n / MAX_STRENGTH)
        pulls = person or constant_force(approach.force_n, approach.stick, approach.turn)
        self.hands = ArmingHands(device, pulls, grip=approach.grip)
        self.episode = Episode(
            robot=robot, operator=operator, device=device, person=self.hands, listeners=[self], sampled=False
        )
        self.loopback, self.truth = self.episode.loop, TrueContact(self.episode.scene)
        self._next_s = -math.inf

    @property
    def disarmed_because(self) -> str | None:
        """Reason for which the robot side stopped the arm; None while it has not stopped the arm."""
        safety = self.loopback.robot.session.safety
        return None if safety.state == "armed" or not safety.stops else safety.stops[-1][1]

    def arm(self) -> float:
        """Run until the pull begins, and return the time of that; FeelaheadError if the robot is not armed in time."""
        began_s = self.episode.arm().acts_since_s
        if self.truth.touched:
            raise FeelaheadError(
                f"the gripper touches {', '.join(sorted(self.truth.touched))} before the pull begins; valid: a scene in"
                " which it touches nothing at first"
            )
        return began_s

    def go_on(self, until_s: float) -> Iterator[float]:
        """Run until a contact, a stop of the arm, or `until_s`; yield the time every 10 ms."""
        clock = self.loopback.clock
        while self.onset is None and self.disarmed_because is None and clock.now() < until_s:
            self.loopback.run_until(min(clock.now() + SAMPLE_S, until_s))
            yield clock.now()

    def trace(self) -> Trace:
        """Return the course so far."""
        time_s, speed_m_s, gap_m, travel = np.array([row[:4] for row in self._rows]).reshape(-1, 4).T.copy()
        strengths = np.array([row[4] for row in self._rows], dtype=np.int64).reshape(-1, ZONE_COUNT)
        return Trace(time_s, speed_m_s, gap_m, travel, strengths)

    def on_sent(self, now_s: float) -> None:
        """Sample the true contacts, and every 10 ms speed, gap, travel and R2's zones."""
        if self.onset is not None:
            return
        run, hands = self.loopback, self.hands
        onset = self.truth.update(run.robot.held)
        if hands.began_s is None:
            return
        self.onset = onset
        strengths, travel = run.device.strengths[1], run.device.travel[1]
        if now_s >= self._next_s or onset is not None:
            self._next_s = now_s + SAMPLE_S - 1e-9
            speed_m_s, gap_m = self.truth.approach()[1], self.truth.gap_m(run.robot.held)
            self._rows.append((now_s - hands.began_s, speed_m_s, gap_m, travel, strengths))


def compile_kernels() -> None:
    """Compile all missing kernels once, so that parallel workers do not each compile them."""
    warm_up(kernels=import_kernels())


def robot_settings(approach: Approach) -> RobotSettings:
    """Return the robot side's settings for the approach; ConfigurationError if model or link cannot be used."""
    return RobotSettings(
        model=approach.model,
        site=approach.site,
        site_axis=approach.site_axis,
        link=approach.link,
        link_model=approach.link_model,
        seed=approach.seed,
        probability=approach.probability,
        law=law_of_robot(approach.law),
        law_paper_share=approach.paper.share,
        enlargement=approach.paper.enlargement,
        assist=approach.assist,
        full_rate=approach.full_rate,
        tick_period=approach.tick_period,
        camera=CameraSettings() if approach.camera_sd_m is None else CameraSettings(sd_m=approach.camera_sd_m),
        arm_limits=approach.arm_limits,
        simulated_limits=approach.simulated_limits,
    )


def run_approach(approach: Approach, person: Person | None = None) -> Outcome:
    """Run one approach until a contact or its end. The same settings give the same outcome.

    person: who pulls, instead of the constant force.

    Raises ConfigurationError if model or link cannot be used. The outcome is `failed` if the robot is not armed in time
    or touches something before the pull.
    """
    run = PullRun(approach, person)
    try:
        began_s = run.arm()
        for _ in run.go_on(began_s + approach.duration_s):
            pass
    except FeelaheadError as error:
        return Outcome("failed", None, None, math.nan, None, None, 0, 0.0, run.trace(), str(error))
    return _outcome(run)


def _outcome(run: PullRun) -> Outcome:
    trace, onset = run.trace(), run.onset
    end: End = "stopped" if stands(trace) else "undecided"
    if onset is not None or run.disarmed_because is not None:
        end = "contact" if onset is not None else "disarmed"
    stopped = end == "stopped"
    # At a contact the arm has braked already in the turn that shows it.
    speeds_m_s = trace.speed_m_s[: None if onset is None else -1].tolist()
    return Outcome(
        end=end,
        contact_speed_mm_s=None if onset is None else 1e3 * onset.closing_speed_m_s,
        contact_with=None if onset is None else onset.thing,
        least_gap_mm=1e3 * float(trace.gap_m.min(initial=math.inf)),
        stops_at_mm=1e3 * float(trace.gap_m[-1]) if stopped else None,
        way_left_mm=1e3 * run.truth.way_left_m(run.truth.approach()[0], run.loopback.robot.held) if stopped else None,
        reversals=reversals(speeds_m_s),
        ended_s=float(trace.time_s[-1]),
        trace=trace,
        why=run.disarmed_because if end == "disarmed" else None,
        later_ms=1e3 * run.loopback.robot.motion.following.stops.later_s,
    )
