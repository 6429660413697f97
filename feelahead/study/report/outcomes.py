"""Outcomes of a study: what each is, how it is compared, and its values from the tables."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

import numpy as np

from common.errors import ConfigurationError
from feelahead.study.protocol import RAW_TLX, Protocol
from feelahead.study.questionnaires import NASA_TLX


class Kind(StrEnum):
    """How an outcome is compared."""

    SHARE = "share"
    """Of trials; difference in percentage points"""
    AMOUNT = "amount"
    """Zero in many trials; difference of means"""
    FACTOR = "factor"
    """Positive; ratio of geometric means"""
    PLAIN = "plain"
    """Difference of means"""
    ANSWER = "answer"
    """One value of a participant under a condition; difference of means"""


@dataclass(frozen=True)
class Outcome:
    """Outcome of a trial or a block."""

    name: str
    """Its column in the table of trials, or its item in the table of answers"""
    title: str
    kind: Kind
    unit: str = ""
    caution: str = ""
    """What a reader has to know about its comparisons"""


OUTCOMES: Final = {
    outcome.name: outcome
    for outcome in (
        Outcome("hit", "trials with a hit", Kind.SHARE, "%"),
        Outcome("completed", "trials completed in time", Kind.SHARE, "%"),
        Outcome("time_s", "time", Kind.FACTOR, "s", "a trial that was not completed counts with the time limit"),
        Outcome("contacts", "contacts a trial", Kind.AMOUNT),
        Outcome("impulse_n_s", "impulse of contacts a trial", Kind.AMOUNT, "N s"),
        Outcome("path_m", "path of the gripper", Kind.FACTOR, "m"),
        Outcome("exposure_s", "time nearer than 5 mm", Kind.AMOUNT, "s"),
        Outcome("least_mm", "least distance", Kind.PLAIN, "mm"),
        Outcome("enlargement_mm", "enlargement while moving", Kind.PLAIN, "mm"),
        Outcome(
            *("fastest_mm_s", "fastest contact", Kind.PLAIN, "mm/s"),
            caution="only pairs of trials that both had a contact, which the conditions themselves choose",
        ),
    )
}
"""Outcomes of a trial, by name"""


@dataclass(frozen=True)
class Tables:
    """A study's protocol and data frames, with the columns of docs/study.md."""

    protocol: Protocol
    trials: Any
    answers: Any
    withdrew: tuple[int, ...] = ()
    """Numbers of participants who withdrew; if the protocol removes their data, the frames lack them"""
    enrolled: tuple[int, ...] = ()
    """Numbers of all participants by the journal, also of those who never began a trial"""
    simulated: bool = False
    """Whether no people took part, which the page says"""

    def __post_init__(self) -> None:
        valid = (*OUTCOMES, "participant", "trial", "attempt", "practice", "block", "condition", "delay_ms", "scene")
        for name, table, columns in (
            ("trials", self.trials, (*valid, "repeat", "seed", "status", "excluded", "recording")),
            ("answers", self.answers, ("participant", "block", "condition", "item", "value")),
        ):
            if missing := [column for column in columns if column not in table.columns]:
                raise ConfigurationError(f"{name}: no column {missing[0]}; valid: {', '.join(columns)}")

    @property
    def analysed(self) -> Any:
        """Trials that count: complete, not practice, not excluded"""
        trials = self.trials
        return trials[(trials.status == "complete") & ~trials.practice.astype(bool) & trials.excluded.isna()]


def outcome_of(name: str) -> Outcome:
    """Return the outcome of a trial, the raw score of NASA-TLX, or the answers to the item of this name."""
    if name in OUTCOMES:
        return OUTCOMES[name]
    if name == RAW_TLX:
        return Outcome(name, "workload (raw NASA-TLX)", Kind.ANSWER)
    scales = {question.name for question in NASA_TLX}
    return Outcome(name, name.removeprefix("tlx ") if name in scales else f"“{name}”", Kind.ANSWER)


def measured(tables: Tables, outcome: Outcome) -> Any:
    """Return a frame of the outcome's values: participant, condition, block, delay_ms, scene, repeat, value.

    Share: 0 or 1. Rows without a value, and of a factor that is not positive, are left out. An answer has delay 0.
    """
    if outcome.kind is Kind.ANSWER:
        return _answers(tables.answers, outcome.name)
    rows = tables.analysed
    found = rows[["participant", "condition", "block", "delay_ms", "scene", "repeat"]].copy()
    found["value"] = rows[outcome.name].astype(float)
    if outcome.name == "time_s":
        found["value"] = found.value.where(rows.completed.astype(bool), tables.protocol.limit_s)
    if outcome.kind is Kind.FACTOR:
        found["value"] = found.value.where(found.value > 0.0)
    return found.dropna(subset="value").reset_index(drop=True)


def scale(kind: Kind, values: Any) -> Any:
    """Return values on the scale on which they are compared: a factor's logarithm, others unchanged."""
    return np.log(values) if kind is Kind.FACTOR else values


def _answers(answers: Any, name: str) -> Any:
    """Return the answers to one item; the raw score is the mean of the six items, if all are answered."""
    items = [question.name for question in NASA_TLX] if name == RAW_TLX else [name]
    rows = answers[answers["item"].isin(items)]
    found = rows.groupby(["participant", "condition", "block"]).value.agg(["mean", "count"]).reset_index()
    found = found[found["count"] == len(items)].rename(columns={"mean": "value"}).drop(columns="count")
    return found.assign(delay_ms=0.0, scene="", repeat=1).reset_index(drop=True)
