"""Whoever has the simulated controller in their hands: the person of the scripted task, or a finger that only pulls."""

from typing import Protocol

from common.protocol.messages import Telemetry
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.simulated_person.person import SimulatedOperator
from operator_side.simulated_person.pulling_hands import PullingHands, constant_force
from operator_side.simulated_person.settings import PersonSettings


class Whoever(Protocol):
    """Someone at a simulated controller."""

    @property
    def doing(self) -> str:
        """What they do, in a word for people."""
        ...

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Look at the screen and move the hands; `delay_s` is the round trip that the person has got used to."""
        ...


def whoever(
    device: SimulatedDualSense,
    settings: PersonSettings,
    seed: int,
    calibration: TravelCalibration | None = None,
    *,
    swap_sides: bool = False,
) -> Whoever:
    """The one that `settings` ask for, at `device`."""
    if settings.pull_n is not None:
        return PullingHands(device, constant_force(settings.pull_n))
    return SimulatedOperator(device, settings, seed, calibration, swap_sides=swap_sides)
