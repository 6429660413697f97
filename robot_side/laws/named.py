"""Laws by name, each imported on first use. To add a law, add its file and one entry here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol

if TYPE_CHECKING:
    from robot_side.laws.law import Law
    from robot_side.tick.explained import Explains

    class NamedLaw(Law, Explains, Protocol):
        """Interface of a law that a robot side can run: it senses, explains its result, and takes another P."""

        def expect(self, probability: float) -> None:
            """Set the probability P of eq. 10; ConfigurationError outside (0, 1)."""


LawName = Literal["swept", "paper"]
"""swept: onset distances along each trigger. paper: the paper's own law (§4.2), one stiffness for both triggers."""


def _swept(*arguments: Any) -> NamedLaw:
    from robot_side.laws.swept import SweptLaw  # noqa: PLC0415

    return SweptLaw(*arguments, maps=True)


def _paper(*arguments: Any) -> NamedLaw:
    from robot_side.laws.paper import PaperLaw  # noqa: PLC0415

    return PaperLaw(*arguments)


LAWS: Final[Mapping[LawName, Callable[..., NamedLaw]]] = {"swept": _swept, "paper": _paper}
"""Factory of each law. Its arguments: uncertainty, standard deviations of the encoders (n,) in rad, joint limits,
motion settings, surroundings."""
