"""One trial: a scripted person reaches, grasps, lifts and places in one scene, over one link, in virtual time."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from common.emulation.clauses import LinkModel
from common.periods import TURN
from common.protocol.uniform_field import uniform_field
from common.roles import Role
from feelahead.both_sides.episode import Episode
from feelahead.both_sides.episode_hands import GRASPING
from feelahead.both_sides.not_placed import why_not_placed
from operator_side.controller.feel import MAX_STRENGTH
from operator_side.dualsense.simulated.trigger_model import zone_of
from operator_side.people.person import SimulatedOperator
from operator_side.people.settings import PersonSettings
from operator_side.settings import OperatorSettings
from robot_side.depth.camera_settings import BY_DEPTH, DepthCameraSettings
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from robot_side.drivers.mujoco.robot_model import SiteAxis
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.laws.inputs import LawInputs
from robot_side.laws.paper_settings import PaperSettings
from robot_side.outcome.hits import Hits
from robot_side.outcome.placing import Placing
from robot_side.settings import CameraSettings, RobotSettings
from robot_side.tick.events import Listener
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

Arm = Literal["off", "mechanical", "reacting"]
"""Condition (arm of the experiment). off: no haptics. mechanical: the triggers resist, but the person does not react.
reacting: the triggers resist and the person reacts."""
_L2, R2 = 0, 1
SAMPLE_S: Final = 0.05
"""Period at which the person's progress is examined, in seconds"""
_TRUTH_S: Final = 0.01
_SETTLES_S: Final = 0.3
MISJUDGES_DEPTH: Final = PersonSettings(aiming="move-and-wait", depth_error_sd_m=0.030, depth_error_mean_m=0.010)
"""Person who sees no obstacle and misjudges distances"""
_MOUNT_M: Final = 0.002
_PICTURES_HZ: Final = 15.0
"""Half of what the cameras give, as each picture takes a processor 20 ms"""


@dataclass(frozen=True)
class Trial:
    """Settings of one trial; two trials with the same seed that differ only in `arm` are a pair."""

    scene: SceneName
    link: str
    arm: Arm
    person: PersonSettings
    duration_s: float
    link_model: LinkModel = "datagram"
    tick_period: str = TURN
    """Period of both sides' turns, such as 4ms"""
    camera_sd_m: float = CameraSettings().sd_m
    """Standard deviation of the camera's error along each axis; the law knows it"""
    probability: float = RobotSettings().probability
    """P of eq. 10"""
    model: Path | None = None
    """MJCF file of an arm instead of the built-in one; `site` and `site_axis` belong to it"""
    site: str | None = None
    site_axis: SiteAxis = "z"
    law: str = "swept"
    """Law of the stiffness, by its name or file; empty: the default"""
    paper: PaperSettings = field(default_factory=PaperSettings)
    """Settings of the paper's laws"""
    by_depth: bool = False
    """Whether depth cameras perceive the scene: one beside the gripper and one on it, 2 mm away from where they seem"""


class _Silent:
    """Law of trials without haptics, which computes nothing."""

    def __init__(self, inputs: LawInputs) -> None:
        del inputs

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the field of two free triggers."""
        del situation, now_s
        free = uniform_field(0)
        return Sensed(l2=free, r2=free)


class Watch(Listener):
    """Run of both sides, and what is counted from the simulation's truth in each tick: hits, strengths, placing."""

    def __init__(self, trial: Trial, seed: int) -> None:
        self.hits = Hits()
        self.pulled_s = self.full_s = 0.0
        """Time for which R2 was pulled, and for which the finger met full strength at R2, in seconds"""
        self.placing = Placing()
        self._next_s = -math.inf
        robot = RobotSettings(
            link=trial.link,
            link_model=trial.link_model,
            tick_period=trial.tick_period,
            seed=seed,
            scene=trial.scene if trial.model is None else None,
            model=trial.model,
            site=trial.site,
            site_axis=trial.site_axis,
            camera=CameraSettings(sd_m=trial.camera_sd_m),
            probability=trial.probability,
            law=trial.law or "swept",
            law_paper_share=trial.paper.share,
            enlargement=trial.paper.enlargement,
            perception=BY_DEPTH if trial.by_depth else None,
            depth_camera=DepthCameraSettings(mount_error_m=_MOUNT_M, rate_hz=_PICTURES_HZ),
        )
        operator = OperatorSettings(
            link=trial.link,
            link_model=trial.link_model,
            tick_period=trial.tick_period,
            seed=seed,
            haptics=trial.arm != "off",
            person=trial.person if trial.arm == "reacting" else replace(trial.person, trust=0.0),
        )
        silent = _Silent if trial.arm == "off" else None
        self.episode = Episode(
            robot=robot, operator=operator, law=silent, person=GRASPING, listeners=[self], sampled=False
        )
        self.loopback, self.scene = self.episode.loop, self.episode.scene
        self._contact, self.truth = TrueContact(self.scene), GroundTruth(self.scene)

    def on_sent(self, now_s: float) -> None:
        """Sample the true contacts, the strength under the finger, and the target's position."""
        held, roles = self.loopback.robot.held, self.scene.roles
        self.hits.take(self._contact.update(held), roles, now_s)
        if now_s >= self._next_s - 1e-9:
            self._next_s = now_s + _TRUTH_S
            strength = self.strength_of(R2)
            self.pulled_s += _TRUTH_S * (strength is not None)
            self.full_s += _TRUTH_S * (strength == MAX_STRENGTH)
            if (target := self.truth.target()) is not None:
                is_target = held is not None and roles[held] is Role.TARGET
                self.placing.observe(target, is_target, self._felt(), now_s)

    def _felt(self) -> bool:
        """Return whether a finger meets resistance at a trigger, or the left motor rumbles."""
        stiff = any((self.strength_of(trigger) or 0) > 0 for trigger in (_L2, R2))
        return stiff or self.loopback.device.rumble.left > 0.0

    def strength_of(self, trigger: int) -> int | None:
        """Return the strength of the zone that the trigger has reached; None for a trigger that is not pulled."""
        device = self.loopback.device
        travel = device.travel[trigger]
        return device.strengths[trigger][zone_of(travel)] if travel > 0.0 else None


def run_trial(trial: Trial, seed: int, sample: Callable[[Watch], None] = lambda _: None) -> dict[str, Any]:
    """Run until the person is done, or until the trial's duration is over. The same trial and seed give the same row.

    From the seed the scene, the errors of camera and encoders, the link's delays and the person are drawn.
    sample: called at the start and then every SAMPLE_S.
    hits: contacts of the gripper with anything but the target, and of the held object with obstacles.
    full_share: share of the time with R2 pulled in which the finger meets full strength.
    finished_s: time from arming until the object is placed and the gripper has drawn back; None if time ran out.
    why_not_placed: where the run ended and what kept the arm still, in words; None if the target was placed.
    felt_before_s: time for which rumble or a stiff trigger was felt, without a break, before the held object touched
    the surface on which it was set down.
    """
    watch = Watch(trial, seed)
    loopback, person, hits = watch.loopback, watch.loopback.person, watch.hits
    assert isinstance(person, SimulatedOperator)  # noqa: S101  # no other is given
    armed_s = done_s = None
    sample(watch)
    while loopback.clock.now() < trial.duration_s and done_s is None:
        loopback.run_until(min(loopback.clock.now() + SAMPLE_S, trial.duration_s))
        if armed_s is None and loopback.robot.session.safety.state == "armed":
            armed_s = loopback.clock.now()
        if person.phase == "done":
            done_s = loopback.clock.now()
        sample(watch)
    # A released object may still fall.
    loopback.run_until(loopback.clock.now() + _SETTLES_S)
    task = loopback.summary()["task"]
    placing = watch.placing.summary(armed_s)
    grasped = task["time_to_grasp_s"] is not None
    finished = placing["placed"] and done_s is not None and armed_s is not None
    return {
        "hits": hits.count,
        "hit_first": hits.first,
        "fastest_hit_mm_s": None if hits.fastest_m_s is None else 1e3 * hits.fastest_m_s,
        "full_share": watch.full_s / watch.pulled_s if watch.pulled_s else None,
        "grasped": grasped,
        "lifted_mm": task["lifted_mm"],
        "placed": placing["placed"],
        "why_not_placed": why_not_placed(loopback, person, placing, armed=armed_s is not None, grasped=grasped),
        "finished_s": (done_s or 0.0) - (armed_s or 0.0) if finished else None,
        "placing_speed_mm_s": placing["contact_speed_mm_s"],
        **{name: placing[name] for name in ("felt_before_s", "felt_before_mm", "tilt_deg")},
    }
