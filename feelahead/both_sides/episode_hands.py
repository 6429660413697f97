"""Hands at an episode's controller, for a person in any form, and why the arm was not armed by them."""

from typing import Any, Final

from feelahead.both_sides.loopback import Loopback, Person
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.people.arming_hands import ArmingHands
from operator_side.people.settings import PersonSettings
from operator_side.people.simulated_hands import own_person, simulated_hands
from operator_side.settings import OperatorSettings

GRASPING: Final = "grasping"
"""Name of the built-in person, who grasps the target, lifts it and sets it down"""


def hands_of(person: Any, device: SimulatedDualSense, settings: OperatorSettings) -> Person:
    """Return the hands of a person: `grasping`, PersonSettings, hands with `tick`, or a person as for `own_person`."""
    if person == GRASPING or isinstance(person, PersonSettings):
        about = person if isinstance(person, PersonSettings) else settings.person
        given = about, settings.seed, settings.calibration
        return simulated_hands(device, *given, swap_sides=settings.swap_sides)
    if hasattr(person, "tick") and not isinstance(person, type):
        hands: Person = person
        return hands
    return ArmingHands(device, own_person(person))


def why_not_armed(run: Loopback, link: str, waited_s: float) -> str:
    """Return, in words, why the hands do not act after `waited_s`: the arm is not armed, or holds nothing yet."""
    robot, hands, now_s = run.robot, run.person, run.clock.now()
    if robot.session.safety.state == "armed":
        gripped = isinstance(hands, ArmingHands) and hands.phase == "grip"
        return f"the hands {'did not grip' if gripped else 'did not act'} within {waited_s:g} s"
    stops = robot.session.safety.stops
    why = f"{stops[-1][1]}; " if stops else ""
    return (
        f"the robot was not armed within {waited_s:g} s over --link {link!r}: {why}loop age"
        f" {robot.loop_age_s(now_s):.2f} s, {robot.session.motion_received} commands arrived"
    )
