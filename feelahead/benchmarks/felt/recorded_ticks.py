"""Ticks of real runs, noted once in virtual time: what a law was asked, so that any law can be asked the same again."""

import functools
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from feelahead.benchmarks.felt.turning import exchanged
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from feelahead.lab.approaches.arming import wait_for_pull
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from operator_side.dualsense.effects.official import MAX_STRENGTH
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.settings import OperatorSettings
from operator_side.simulated_person.pulling_hands import PullingHands, constant_force
from robot_side.ahead.law import Law, Sensed, Situation
from robot_side.ahead.swept_law import SweptLaw
from robot_side.arm.port import ArmState, GripperPose
from robot_side.core import RobotSide
from robot_side.settings import RobotSettings
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import Scene, load_scene

DEMO: Final = "demo"
FORCE_N: Final = 2.0
_STRONGEST_N: Final = 2.0
_BEFORE_S: Final = 0.5
"""Of an approach, so much before its pull is kept, too."""


@dataclass(frozen=True)
class Tick:
    """What the law was asked in one tick, and from which state the pose in it came."""

    now_s: float
    situation: Situation
    state: ArmState


@dataclass(frozen=True)
class Recorded:
    """A run."""

    name: str
    ticks: tuple[Tick, ...]
    law: tuple[Any, ...]
    """The arguments of SweptLaw that it had."""


class _Noting:
    """A law and the kinematics before it, in front of the real ones."""

    def __init__(self, kinematics: MujocoKinematics, law: Law) -> None:
        self.has_fingers = kinematics.has_fingers
        self.ticks: list[Tick] = []
        self._kinematics, self._law = kinematics, law
        self._state: ArmState | None = None

    def pose(self, state: ArmState) -> GripperPose:
        """As the kinematics has it."""
        self._state = state
        return self._kinematics.pose(state)

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """As the law has it."""
        if self._state is not None:
            self.ticks.append(Tick(now_s, situation, self._state))
        return self._law.sense(situation, now_s)

    def summary(self) -> dict[str, int]:
        """The law's."""
        return self._law.summary()


def record(name: str, duration_s: float, seed: int = 0) -> Recorded:
    """The demo, or a pull of 2 N in the frozen scene of this name, for `duration_s`; the same seed gives the same."""
    model = None if name == DEMO else frozen_scene(name)
    robot = RobotSettings(model=model, site=None if model is None else SITE, seed=seed)
    noting: list[_Noting] = []
    laws: list[tuple[Any, ...]] = []
    device = SimulatedDualSense(strength_step_n=_STRONGEST_N / MAX_STRENGTH)
    hands = PullingHands(device, constant_force(FORCE_N))
    with exchanged("robot_side.assembly", SweptLaw=functools.partial(_new_law, laws)):
        run = Loopback(
            LoopbackSettings(robot, OperatorSettings(seed=seed)),
            scene=scene_of(name),
            device=device,
            person=None if model is None else lambda _: hands,
            robot_side=functools.partial(_noted, noting),
        )
    from_s = 0.0 if model is None else wait_for_pull(run, hands, "") - _BEFORE_S
    run.run_until(from_s + duration_s)
    kept = tuple(tick for tick in noting[0].ticks if tick.now_s >= from_s)
    return Recorded(name, kept, laws[0])


def scene_of(name: str) -> Scene:
    """Where the run of this name takes place, at its start."""
    return load_scene(None) if name == DEMO else load_scene(frozen_scene(name), SITE)


def _noted(
    noting: list[_Noting], arm: Any, kinematics: Any, camera: Any, law: Law, *others: Any, **named: Any
) -> RobotSide:
    noting.append(_Noting(kinematics, law))
    return RobotSide(arm, noting[0], camera, noting[0], *others, **named)


def _new_law(laws: list[tuple[Any, ...]], *arguments: Any) -> SweptLaw:
    laws.append(arguments)
    return SweptLaw(*arguments)


def with_cover(recorded: Recorded, cover_m: float) -> Recorded:
    """The same, had the gripper been covered by spheres that stand out so far; what it held stays as it was."""
    scene = scene_of(recorded.name)
    own, other = MujocoKinematics(scene), MujocoKinematics(scene, cover_m)
    first = len(own.cover.radii_m)
    return replace(recorded, ticks=tuple(_covered(tick, other, first) for tick in recorded.ticks))


def _covered(tick: Tick, kinematics: MujocoKinematics, first: int) -> Tick:
    """`first`: after so many spheres those of what is held follow."""
    before, pose = tick.situation.pose, kinematics.pose(tick.state)

    def joined(name: str) -> Any:
        return np.concatenate([getattr(pose, name), getattr(before, name)[first:]])

    names = "sphere_centers_m", "sphere_radii_m", "sphere_on_finger"
    pose = replace(pose, **{name: joined(name) for name in names})
    return replace(tick, situation=replace(tick.situation, pose=pose))
