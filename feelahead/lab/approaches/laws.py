"""Laws that are compared, each a way from the situation to the strengths that the fingers feel."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from common.protocol.messages import Compensation
from robot_side.laws.named import require_law
from robot_side.laws.paper_settings import PAPERS, PaperSettings

TriedLaw = str
"""Name of a law, one of `LAWS`, of an installed package, or a file"""
LAWS: Final[tuple[TriedLaw, ...]] = ("swept", "swept_robot", "paper", "paper-isotropic", "none", "full")
"""swept: contact distances along each trigger, rendered over its travel (docs/feel.md); compensation by the operator.
swept_robot: the same with v t_d by the robot side (--compensation robot). paper: the paper's law (§4.2), the
overlap ahead over a share f of the enlarged gripper. paper-isotropic: the same as printed, the total overlap for both
triggers. none: no haptics. full: always the strongest effect on both
triggers."""


def require_tried(laws: Sequence[TriedLaw], flag: str, built_in: Sequence[TriedLaw] = LAWS) -> None:
    """Raise ValueError, which names `flag`, unless there is a law, each is known and given once."""
    if not laws or len(set(laws)) < len(laws):
        raise ValueError(
            f"--{flag} {' '.join(laws)}: none is given, or one is given twice; valid: one or more of"
            f" {', '.join(built_in)}, each once"
        )
    for law in laws:
        require_law(law, built_in)


def is_paper(law: TriedLaw) -> bool:
    """Return whether the law is the paper's, in one of its forms: it has a share f."""
    return law in PAPERS


def with_papers(
    laws: Iterable[TriedLaw], papers: Sequence[PaperSettings]
) -> Iterator[tuple[TriedLaw, PaperSettings | None]]:
    """Yield each law; one of the paper's with each of its settings, another one with None."""
    for law in laws:
        yield from ((law, one) for one in papers) if is_paper(law) else ((law, None),)


def paper_figures(paper: PaperSettings | None) -> dict[str, float | str | None]:
    """Return the columns of a table that name the settings of the paper's law; None for another law."""
    if paper is None:
        return {"share": None, "enlargement": None}
    return {"share": paper.share, "enlargement": paper.enlargement}


def with_compensation(law: TriedLaw, compensation: Compensation) -> TriedLaw:
    """Return the law with this side compensating the delay; it makes a difference for `swept` only."""
    return "swept_robot" if law == "swept" and compensation == "robot" else law


def without_compensation(law: TriedLaw) -> str:
    """Return the name that `--law` has for this law."""
    return "swept" if law == "swept_robot" else law


def in_words(law: TriedLaw) -> str:
    """Return the law's name as it is printed."""
    return "swept, delay by the robot" if law == "swept_robot" else law


def compensation_of(law: TriedLaw) -> Compensation:
    """Return the side that compensates the delay."""
    return "robot" if law == "swept_robot" or is_paper(law) else "operator"


def law_of_robot(law: TriedLaw) -> str:
    """Return the law that the robot side's settings must name."""
    return "swept" if law in ("swept_robot", "none", "full") else law
