"""Choice of the scripted person at the simulated controller: one who does a whole task, or one who only pulls."""

from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.arming_hands import ArmingHands, constant_force
from operator_side.people.person import SimulatedOperator
from operator_side.people.settings import PersonSettings

SimulatedHands = SimulatedOperator | ArmingHands


def simulated_hands(
    device: SimulatedDualSense,
    settings: PersonSettings,
    seed: int,
    calibration: TravelCalibration | None = None,
    *,
    swap_sides: bool = False,
) -> SimulatedHands:
    """Make the scripted person that `settings` select, at the controller `device`."""
    if settings.pull_n is not None:
        return ArmingHands(device, constant_force(settings.pull_n))
    return SimulatedOperator(device, settings, seed, calibration, swap_sides=swap_sides)
