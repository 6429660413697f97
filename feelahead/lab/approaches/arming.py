"""Run both sides from their start until the arm is armed and the hand begins to pull."""

from common.errors import FeelaheadError
from feelahead.both_sides.loopback import Loopback
from operator_side.people.pulling_hands import PullingHands

LONGEST_ARMING_S = 30.0
_LOOK_S = 0.01


def wait_for_pull(run: Loopback, hands: PullingHands, link: str) -> float:
    """Run until the pull begins, and return the time of that; FeelaheadError if the robot is not armed in time."""
    while hands.pull_began_s is None:
        run.run_until(run.clock.now() + _LOOK_S)
        if run.clock.now() > LONGEST_ARMING_S:
            stops = run.robot.session.safety.stops
            why = f"{stops[-1][1]}; " if stops else ""
            grip = " and did not grip" if hands.phase == "grip" else ""
            raise FeelaheadError(
                f"the robot was not armed{grip} within {LONGEST_ARMING_S:g} s over --link {link!r}: {why}loop age"
                f" {run.robot.loop_age_s(run.clock.now()):.2f} s, {run.robot.session.motion_received} commands arrived"
            )
    return hands.pull_began_s
