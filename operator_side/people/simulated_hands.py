"""Choice of the scripted person at the simulated controller: one who does a whole task, or one of somebody else."""

from pathlib import Path

from common.errors import ConfigurationError
from common.files.plugged import fault_in_words, find, require_methods
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.arming_hands import ArmingHands
from operator_side.people.person import SimulatedOperator
from operator_side.people.port import Person
from operator_side.people.settings import PersonSettings

SimulatedHands = SimulatedOperator | ArmingHands


def simulated_hands(
    device: SimulatedDualSense,
    settings: PersonSettings,
    seed: int,
    calibration: TravelCalibration | None = None,
    *,
    swap_sides: bool = False,
    own: object = None,
) -> SimulatedHands:
    """Make the scripted person that `settings` select, at the controller `device`.

    own: a person of somebody else's, instead of that one (see `own_person`).
    """
    if own is not None:
        return ArmingHands(device, own_person(own))
    return SimulatedOperator(device, settings, seed, calibration, swap_sides=swap_sides)


def own_person(given: object) -> Person:
    """Return the person that `given` is, names or makes: an object, a FILE.py, an installed name, a class or function.

    ConfigurationError if it has no `act`.
    """
    person = find("person", str(given), {}) if isinstance(given, str | Path) else given
    if callable(person) and (isinstance(person, type) or not hasattr(person, "act")):
        try:
            person = person()
        except (Exception, SystemExit) as error:  # anybody's code
            raise ConfigurationError(f"person: cannot be made without arguments: {fault_in_words(error)}") from error
    require_methods("person", person, {"act": "seen"})
    assert isinstance(person, Person)  # noqa: S101  # it has the method
    return person
