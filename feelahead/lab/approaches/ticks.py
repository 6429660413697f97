"""Ticks of runs of both sides, recorded once in virtual time, so that any law can be given the same inputs."""

from dataclasses import dataclass
from typing import Final

from common.protocol.messages import Vector2
from feelahead.both_sides.episode import Episode
from feelahead.both_sides.episode_hands import GRASPING
from feelahead.lab.approaches.frozen import ASIDE, GRIPPED, SITE, frozen_scene
from operator_side.controller.feel import MAX_STRENGTH
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.people.arming_hands import ArmingHands, constant_force
from operator_side.settings import OperatorSettings
from robot_side.laws.swept import SweptLaw
from robot_side.settings import RobotSettings
from robot_side.tick import events
from robot_side.tick.events import Listener
from robot_side.tick.situation import Situation

DEMO: Final = "demo"
FORCE_N: Final = 2.0
_STRONGEST_N: Final = 2.0
_STRAIGHT: Final[tuple[Vector2, Vector2]] = (0.0, 0.0), (0.0, 0.0)
_BEFORE_S: Final = 0.5
"""Time before the pull from which on ticks are kept, in seconds."""


@dataclass(frozen=True)
class Tick:
    """Input of the law in one tick."""

    now_s: float
    situation: Situation


@dataclass(frozen=True)
class Recorded:
    """Ticks of one run, with its settings."""

    name: str
    ticks: tuple[Tick, ...]
    settings: RobotSettings

    def new_law(self) -> SweptLaw:
        """Return a new law with the settings of the run, as it was at the run's start."""
        law = Episode(robot=self.settings, sampled=False).parts.law
        if not isinstance(law, SweptLaw):
            raise TypeError(f"law is of type {type(law).__name__}; valid: a SweptLaw")
        # Fields along the triggers alone; contact distances from around are not computed.
        law.looking.probes = None
        return law


class _Noting(Listener):
    """Listener that stores the law's inputs in each tick."""

    def __init__(self) -> None:
        self.ticks: list[Tick] = []

    def on_tick(self, tick: events.Tick) -> None:
        """Store one tick."""
        if tick.found is not None:
            self.ticks.append(Tick(tick.now_s, tick.found.situation))


def record(name: str, duration_s: float, seed: int = 0, sticks: tuple[Vector2, Vector2] | None = None) -> Recorded:
    """Run the demo, or a pull of 2 N in the frozen scene called `name`, for `duration_s`; the seed decides all of it.

    sticks: deflections of the stick that moves across and of the stick that turns; None: those of the scene.
    """
    model = None if name == DEMO else frozen_scene(name)
    robot = RobotSettings(model=model, site=None if model is None else SITE, seed=seed, full_rate=True)
    device = SimulatedDualSense(strength_step_n=_STRONGEST_N / MAX_STRENGTH)
    across, turning = ASIDE.get(name, _STRAIGHT) if sticks is None else sticks
    hands = ArmingHands(device, constant_force(FORCE_N, across, turning), grip=name in GRIPPED)
    episode = Episode(
        robot=robot,
        operator=OperatorSettings(seed=seed, full_rate=True),
        device=device,
        person=GRASPING if model is None else hands,
        listeners=[noting := _Noting()],
        sampled=False,
    )
    from_s = 0.0 if model is None else episode.arm().acts_since_s - _BEFORE_S
    episode.loop.run_until(from_s + duration_s)
    return Recorded(name, tuple(tick for tick in noting.ticks if tick.now_s >= from_s), robot)
