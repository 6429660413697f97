"""Law of somebody else: one method is enough, and what it leaves out is empty."""

from typing import Any, Final

from common.errors import ConfigurationError, FeelaheadError
from common.files.plugged import fault_in_words, require_methods
from common.protocol.around import Around
from common.protocol.view_messages import EnlargementTerms
from robot_side.arm.port import GripperPose
from robot_side.laws.inputs import LawInputs
from robot_side.tick.explained import Trigger, TriggerExplained
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
                f"law {name}: is a {type(given).__name__}; valid: a class or function that takes a LawInputs, or an"
                " object with sense(situation, now_s)"
            )
        try:
            self._law = given(inputs) if makes else given
        except Exception as error:  # anybody's code
            said = fault_in_words(error)
            raise ConfigurationError(f"law {name}: cannot be made from the law's inputs: {said}") from error
        require_methods(f"law {name}", self._law, {"sense": "situation, now_s"})
        self._name = name

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the law's result; FeelaheadError if it fails, or the result is none: the run ends, and says why."""
        try:
            sensed = self._law.sense(situation, now_s)
        except Exception as error:  # anybody's code
            raise FeelaheadError(f"law {self._name}: {fault_in_words(error)}") from error
        if not isinstance(sensed, Sensed):
            raise FeelaheadError(
                f"law {self._name}: sense returned a {type(sensed).__name__}; valid: a Sensed, as inputs.sensed makes"
            )
        return sensed

    def around(self, pose: GripperPose) -> Around | None:
        """Return the law's map of onset distances, if it has one."""
        return self._law.around(pose) if hasattr(self._law, "around") else None

    def summary(self) -> dict[str, int]:
        """Return the law's counts, if it has any."""
        return self._law.summary() if hasattr(self._law, "summary") else {}

    def expect(self, probability: float) -> None:
        """Pass on another P of eq. 10 to a law that takes one."""
        if hasattr(self._law, "expect"):
            self._law.expect(probability)

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> TriggerExplained:
        """Return the law's terms and overlaps, if it explains itself."""
        if hasattr(self._law, "explain"):
            explained: TriggerExplained = self._law.explain(trigger, situation, sensed)
            return explained
        return TriggerExplained(_NO_TERMS, {})
