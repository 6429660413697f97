"""Law of somebody else: one method is enough, and what it leaves out is empty."""

from typing import Any, Final

from common.errors import ConfigurationError, FeelaheadError
from common.files.plugged import fault_in_words, require_methods
from common.protocol.around import Around
from common.protocol.view_messages import EnlargementTerms
from common.skipped import Part
from robot_side.arm.port import GripperPose
from robot_side.field import total_overlap  # noqa: F401  # so that its kernel is compiled before the first turn
from robot_side.laws.inputs import LawInputs
from robot_side.tick.explained import Trigger
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

_NO_TERMS: Final = EnlargementTerms(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class OwnLaw:
    """Law with the method `sense`, and any of `around`, `summary`, `explain` and `expect` (see `NamedLaw`)."""

    def __init__(self, name: str, given: Any, inputs: LawInputs) -> None:
        """given: the law, or what makes one from `inputs`: a class or function. ConfigurationError if it does not."""
        makes = isinstance(given, type) or not hasattr(given, "sense")
        if makes and not callable(given):
            raise ConfigurationError(
                f"law {name}: is of type {type(given).__name__}; valid: a class or function that takes a LawInputs, or"
                " an object with sense(situation, now_s)"
            )
        try:
            self._law = given(inputs) if makes else given
        except (Exception, SystemExit) as error:  # anybody's code
            said = fault_in_words(error)
            raise ConfigurationError(f"law {name}: cannot be made from the law's inputs: {said}") from error
        require_methods(f"law {name}", self._law, {"sense": "situation, now_s"})
        self._name = name

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the law's result; FeelaheadError if it fails, or the result is none: the run ends, and says why."""
        sensed = self._call("sense", situation, now_s)
        if not isinstance(sensed, Sensed):
            raise FeelaheadError(
                f"law {self._name}: sense returned {type(sensed).__name__}; valid: a Sensed, as inputs.sensed makes"
            )
        return sensed

    def around(self, pose: GripperPose) -> Around | None:
        """Return the law's map of onset distances, if it has one."""
        around: Around | None = self._call("around", pose)
        return around

    def summary(self) -> dict[str, int]:
        """Return the law's counts, if it has any."""
        return self._call("summary") or {}

    def skipped(self) -> dict[str, Part]:
        """Return nothing: what a law of somebody else skips is not known."""
        return {}

    def expect(self, probability: float) -> None:
        """Pass on another P of eq. 10 to a law that takes one."""
        self._call("expect", probability)

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> EnlargementTerms:
        """Return the law's terms, if it explains itself."""
        return self._call("explain", trigger, situation, sensed) or _NO_TERMS

    def _call(self, method: str, *arguments: object) -> Any:
        """Call a method of the law's, if it has it; FeelaheadError if it fails."""
        if not hasattr(self._law, method):
            return None
        try:
            return getattr(self._law, method)(*arguments)
        except FeelaheadError:
            raise
        except (Exception, SystemExit) as error:  # anybody's code
            raise FeelaheadError(f"law {self._name}: {method}: {fault_in_words(error)}") from error
