"""Questions after each block: NASA-TLX and items of the study's own, as data; checks of answers.

NASA-TLX: Hart and Staveland, Development of NASA-TLX (Task Load Index), in: Hancock and Meshkati, Human Mental
Workload, 1988; six items of 21 gradations, 0 to 100. The raw score, without weights: Hart, NASA-Task Load Index
(NASA-TLX); 20 years later, Proceedings of the Human Factors and Ergonomics Society 50, 2006.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from statistics import fmean
from typing import Annotated, Final

from msgspec import Meta

from common.limits import Limited


@dataclass(frozen=True)
class Item(Limited):
    """Item of the study's own, as of Likert's kind: one of `points` steps from 1."""

    text: Annotated[str, Meta(min_length=1, max_length=200)]
    """What is asked; also the item's name in the table of answers"""
    low: Annotated[str, Meta(min_length=1, max_length=60)] = "strongly disagree"
    """Words at the lowest step"""
    high: Annotated[str, Meta(min_length=1, max_length=60)] = "strongly agree"
    """Words at the highest step"""
    points: Annotated[int, Meta(ge=2, le=11)] = 7
    """Number of steps"""


@dataclass(frozen=True)
class Question:
    """Question as a page shows it."""

    name: str
    """Name in the table of answers"""
    text: str
    low: str
    high: str
    values: tuple[float, ...]
    """Valid answers, from `low` to `high`"""


_GRADATIONS: Final = tuple(5.0 * step for step in range(21))
NASA_TLX: Final = tuple(
    Question(f"tlx {name}", text, *ends, _GRADATIONS)
    for name, text, ends in (
        ("mental demand", "How mentally demanding was the task?", ("very low", "very high")),
        ("physical demand", "How physically demanding was the task?", ("very low", "very high")),
        ("temporal demand", "How hurried or rushed was the pace of the task?", ("very low", "very high")),
        (
            "performance",
            "How successful were you in accomplishing what you were asked to do?",
            ("perfect", "failure"),
        ),
        (
            "effort",
            "How hard did you have to work to accomplish your level of performance?",
            ("very low", "very high"),
        ),
        (
            "frustration",
            "How insecure, discouraged, irritated, stressed, and annoyed were you?",
            ("very low", "very high"),
        ),
    )
)
"""The six items; more is worse in each, so that none is turned around for the score"""


def questions(items: Iterable[Item], *, tlx: bool) -> tuple[Question, ...]:
    """Return what is asked after a block, NASA-TLX first."""
    own = (
        Question(item.text, item.text, item.low, item.high, tuple(float(step + 1) for step in range(item.points)))
        for item in items
    )
    return (*(NASA_TLX if tlx else ()), *own)


def check_answers(asked: Iterable[Question], answers: Mapping[str, float]) -> None:
    """Raise ValueError unless each question has one of its valid answers, and nothing else is answered."""
    valid = {question.name: question.values for question in asked}
    if unknown := answers.keys() - valid.keys():
        raise ValueError(f"answers: {', '.join(sorted(unknown))}: not asked; valid: {', '.join(valid)}")
    for name, values in valid.items():
        if (answer := answers.get(name)) not in values:
            said = "missing" if answer is None else f"{answer:g}"
            raise ValueError(f"answers: {name}: {said}; valid: {values[0]:g}, {values[1]:g} ... {values[-1]:g}")


def raw_tlx(answers: Mapping[str, float]) -> float | None:
    """Return the raw score, 0 to 100: the mean of the six items; None if one of them is missing."""
    found = [answers[item.name] for item in NASA_TLX if item.name in answers]
    return fmean(found) if len(found) == len(NASA_TLX) else None
