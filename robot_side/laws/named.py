"""Laws by name, each imported on first use. To add a law here, add its file and one entry.

Other laws come from installed packages, and from files: see `common.files.plugged`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Final, Protocol, cast

from common.files.plugged import find, require_name

if TYPE_CHECKING:
    from robot_side.laws.inputs import LawInputs
    from robot_side.laws.law import Law
    from robot_side.tick.explained import Explains

    class NamedLaw(Law, Explains, Protocol):
        """Interface of a law that a robot side can run: it senses, explains its result, and takes another P."""

        def expect(self, probability: float) -> None:
            """Set the probability P of eq. 10; ConfigurationError outside (0, 1)."""


def _swept(inputs: LawInputs) -> NamedLaw:
    from robot_side.laws.swept import SweptLaw  # noqa: PLC0415

    return SweptLaw(inputs, maps=True)


def _paper(inputs: LawInputs) -> NamedLaw:
    from robot_side.laws.paper import PaperLaw  # noqa: PLC0415

    return PaperLaw(inputs)


def _paper_isotropic(inputs: LawInputs) -> NamedLaw:
    from robot_side.laws.paper import PaperLaw  # noqa: PLC0415

    return PaperLaw(inputs, isotropic=True)


def _margin(inputs: LawInputs) -> NamedLaw:
    from robot_side.laws.paper import MarginLaw  # noqa: PLC0415

    return MarginLaw(inputs)


LAWS: Final[Mapping[str, Callable[[LawInputs], NamedLaw]]] = {
    "swept": _swept,
    "paper": _paper,
    "paper-isotropic": _paper_isotropic,
    "margin": _margin,
}
"""Built-in laws. swept: onset distances along each trigger. paper: the paper's own law (§4.2), one stiffness for each
trigger. paper-isotropic: its printed form, with the same stiffness for both. margin: the
paper's with a fixed enlargement."""


def make_law(law: object, inputs: LawInputs) -> NamedLaw:
    """Make a law from its name, a file or an object (see `OwnLaw`); ConfigurationError if that is no law."""
    given = find_law(law) if isinstance(law, str) else law
    if given in LAWS.values():
        return cast("Callable[[LawInputs], NamedLaw]", given)(inputs)
    from robot_side.laws.own import OwnLaw  # noqa: PLC0415

    return OwnLaw(law if isinstance(law, str) else getattr(law, "__name__", type(law).__name__), given, inputs)


def require_law(name: str, built_in: Collection[str] = LAWS) -> None:
    """Raise ConfigurationError unless `name` is a known law or a file; no file is read, and nobody's code is run."""
    require_name("law", name, built_in)


def find_law(name: str) -> object:
    """Return what makes the law with this name, or of this file; ConfigurationError for an unknown one."""
    return find("law", name, LAWS)
