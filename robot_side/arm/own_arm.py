"""Arm of somebody else in this process: what it makes of the simulated arm, and how its faults are told."""

from typing import Any, Final

from common.arrays import FloatArray
from common.clock import Clock
from common.errors import FeelaheadError
from common.files.plugged import fault_in_words, made_of
from robot_side.arm.port import Arm, ArmState

_METHODS: Final = {
    "command": "joint_velocity_rad_s, valid_until_s",
    "command_gripper": "closing, valid_until_s",
    "state": "now_s",
}


class OwnArm(Arm):
    """Arm with three methods; joints and pace are the simulated arm's. Its faults end the run by name and line."""

    def __init__(self, part: Any, simulated: Arm) -> None:
        self._part, self._simulated = part, simulated

    @property
    def joint_count(self) -> int:
        """As the simulated arm"""
        return self._simulated.joint_count

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Pass the command on."""
        self._call("command", joint_velocity_rad_s, valid_until_s)

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Pass the command on."""
        self._call("command_gripper", closing, valid_until_s)

    def state(self, now_s: float) -> ArmState:
        """Return its state; FeelaheadError if it returns none."""
        state = self._call("state", now_s)
        if not isinstance(state, ArmState):
            raise FeelaheadError(f"{self._name}: state returned {type(state).__name__}; valid: an ArmState")
        return state

    def give_way(self, clock: Clock) -> None:
        """As the simulated arm"""
        self._simulated.give_way(clock)

    @property
    def share_of_real_time(self) -> float:
        """As the simulated arm"""
        return self._simulated.share_of_real_time

    def take_share_of_real_time(self) -> float:
        """As the simulated arm"""
        return self._simulated.take_share_of_real_time()

    @property
    def _name(self) -> str:
        return f"arm {type(self._part).__name__}"

    def _call(self, method: str, *arguments: object) -> object:
        try:
            result: object = getattr(self._part, method)(*arguments)
        except FeelaheadError:
            raise
        except (Exception, SystemExit) as error:  # anybody's code
            raise FeelaheadError(f"{self._name}: {fault_in_words(error)}") from error
        return result


def moved_by(given: object, simulated: Arm) -> Arm:
    """Return the arm that `given`, a function, a name or a file, makes of the simulated one; that one if None.

    ConfigurationError if it makes none.
    """
    return simulated if given is None else OwnArm(made_of("arm", given, simulated, _METHODS), simulated)
