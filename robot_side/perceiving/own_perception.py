"""Perception of somebody else's in this process: what it makes of the simulated camera, and how its faults are told."""

from typing import Any, Final

from common.errors import FeelaheadError
from common.files.plugged import fault_in_words, made_of
from common.roles import Role
from robot_side.surroundings.perceived import ObjectSource, PerceivedObjects

_METHODS: Final = {"perceive": "now_s", "set_role": "name, role"}


class OwnPerception:
    """Source of objects whose faults end the run by name and line."""

    def __init__(self, part: Any) -> None:
        self._part = part

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return its newest frame; FeelaheadError if it fails, or returns none."""
        try:
            frame = self._part.perceive(now_s)
        except (Exception, SystemExit) as error:  # anybody's code
            raise FeelaheadError(f"perception {type(self._part).__name__}: {fault_in_words(error)}") from error
        if not isinstance(frame, PerceivedObjects):
            raise FeelaheadError(
                f"perception {type(self._part).__name__}: perceive returned {type(frame).__name__}; valid: a"
                " PerceivedObjects, such as the simulated camera's"
            )
        return frame

    def set_role(self, name: str, role: Role) -> None:
        """Pass the role on."""
        self._part.set_role(name, role)


def perceived_by(given: object, camera: ObjectSource) -> ObjectSource:
    """Return the source that `given`, a function, a name or a file, makes of the camera; the camera if None.

    ConfigurationError if it makes none.
    """
    return camera if given is None else OwnPerception(made_of("perception", given, camera, _METHODS))
