"""feelahead: networked teleoperation in which the operator feels what is ahead.

These names are for scripts; docs/python.md shows them at work. Each is imported when it is first used, so a machine
needs only what it uses.
"""

import sys
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from common.link_model import DelayLine, LinkProfile
    from feelahead.both_sides.episode import Episode
    from operator_side.controller.port import Controller
    from operator_side.people.port import FingerInput, Person, Seen
    from robot_side import overlap as overlaps
    from robot_side.arm.port import Arm
    from robot_side.enlargement import enlargement_distance
    from robot_side.laws.inputs import LawInputs
    from robot_side.laws.law import Law
    from robot_side.surroundings.perceived import ObjectSource
    from robot_side.tick.sensed import Sensed
    from robot_side.tick.situation import Situation

    __version__: str

_PLACES: Final = {
    "Arm": "robot_side.arm.port",
    "Controller": "operator_side.controller.port",
    "DelayLine": "common.link_model",
    "Episode": "feelahead.both_sides.episode",
    "FingerInput": "operator_side.people.port",
    "Law": "robot_side.laws.law",
    "LawInputs": "robot_side.laws.inputs",
    "LinkProfile": "common.link_model",
    "ObjectSource": "robot_side.surroundings.perceived",
    "Person": "operator_side.people.port",
    "Seen": "operator_side.people.port",
    "Sensed": "robot_side.tick.sensed",
    "Situation": "robot_side.tick.situation",
    "enlargement_distance": "robot_side.enlargement",
    "overlaps": "robot_side.overlap",
}
"""Module of each name; `overlaps` is the module itself"""

__all__ = [  # made by __getattr__
    "Arm",
    "Controller",
    "DelayLine",
    "Episode",
    "FingerInput",
    "Law",
    "LawInputs",
    "LinkProfile",
    "ObjectSource",
    "Person",
    "Seen",
    "Sensed",
    "Situation",
    "enlargement_distance",
    "overlaps",
]


def _require_own_common() -> None:
    """Raise ImportError if Python finds something else of the name `common` before feelahead's own package."""
    try:
        found = find_spec("common.errors") is not None
    except ModuleNotFoundError:
        found = False
    if not found:
        first = sys.modules.get("common")
        where = getattr(first, "__file__", None) or "nowhere"
        raise ImportError(
            f"feelahead's package `common` is hidden by {where}; valid: another name for your own file or folder, or"
            " feelahead installed as a wheel (pip install .), which shares the folder with other packages"
        )


_require_own_common()


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415  # loads the library for electronic mail

        return version("feelahead")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; valid: {', '.join(__all__)}")
    module = import_module(_PLACES[name])
    return module if name == "overlaps" else getattr(module, name)


def __dir__() -> list[str]:
    return __all__
