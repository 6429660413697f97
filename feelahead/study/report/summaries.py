"""Summaries: each outcome by condition and delay, by block, each answer by condition, and who took part."""

from typing import Any, Final

import numpy as np

from feelahead.study.protocol import RAW_TLX
from feelahead.study.report.contrasts import Compared
from feelahead.study.report.outcomes import OUTCOMES, Kind, Outcome, Tables, measured, outcome_of
from feelahead.study.report.participants import mean_interval, share_interval

_STATES: Final = ("complete", "fault", "withdrawn")


def cells(tables: Tables) -> Any:
    """Return a frame with a row for each outcome, condition and delay: participants, trials, value, low, high.

    value: the mean over participants of their means. low, high: its 95 % interval, not a number for fewer than
    three, or all alike.
    """
    return _summed(tables, OUTCOMES.values(), ["condition", "delay_ms"])


def by_block(tables: Tables) -> Any:
    """Return the same for hits and time, by block: what practice or fatigue does, as conditions are balanced."""
    return _summed(tables, (OUTCOMES["hit"], OUTCOMES["time_s"]), ["block"])


def answers(tables: Tables) -> Any:
    """Return the same for each item and the raw score of NASA-TLX, by condition."""
    asked = [question.name for question in tables.protocol.questions]
    scores = [RAW_TLX] if tables.protocol.tlx else []
    return _summed(tables, [outcome_of(name) for name in (*scores, *asked)], ["condition"])


def _summed(tables: Tables, outcomes: Any, keys: list[str]) -> Any:
    import pandas as pd  # noqa: PLC0415

    rows = []
    for outcome in outcomes:
        for levels, part in measured(tables, outcome).groupby(keys):
            means = part.groupby("participant").value.mean().to_numpy(np.float64)
            rows.append(
                {"outcome": outcome.name}
                | dict(zip(keys, levels, strict=True))
                | {"participants": len(means), "trials": len(part), "value": float(means.mean())}
                | dict(zip(("low", "high"), _interval(outcome, means, tables.protocol.seed), strict=True))
            )
    frame = pd.DataFrame(rows, columns=["outcome", *keys, "participants", "trials", "value", "low", "high"])
    if "condition" in keys:  # in the protocol's order
        frame["place"] = frame.condition.map({name: place for place, name in enumerate(tables.protocol.conditions)})
        outcome_order = {name: place for place, name in enumerate(dict.fromkeys(frame.outcome))}
        frame["first"] = frame.outcome.map(outcome_order)
        frame = frame.sort_values(["first", "place", *keys[1:]]).drop(columns=["first", "place"])
    return frame.reset_index(drop=True)


def _interval(outcome: Outcome, means: Any, seed: int) -> tuple[float, float]:
    found = (share_interval if outcome.kind is Kind.SHARE else mean_interval)(means, seed)
    return (np.nan, np.nan) if found is None else found


def flow(tables: Tables, found: tuple[Compared, ...]) -> tuple[tuple[str, int], ...]:
    """Return the flow of participants and trials: what is counted, and its number."""
    trials = tables.trials
    real = trials[~trials.practice.astype(bool)]
    counted = [one.effect.participants for one in found]
    contrasts = (("participants in the contrast with fewest", min(counted)),) if counted else ()
    return (
        ("participants planned", tables.protocol.participants),
        ("participants who were enrolled", len(tables.enrolled)),
        ("of these without a trial in the data", len({*tables.enrolled} - {*trials.participant})),
        (f"participants who withdrew (data: {tables.protocol.withdrawn})", len(tables.withdrew)),
        ("participants with trials that count", tables.analysed.participant.nunique()),
        *contrasts,
        ("trials of practice", int(trials.practice.astype(bool).sum())),
        ("other trials that were begun", len(real)),
        *((f"of these {state}", int((real.status == state).sum())) for state in _STATES),
        ("complete, and excluded", int(((real.status == "complete") & real.excluded.notna()).sum())),
        ("trials that count", len(tables.analysed)),
        ("trials that count in a full study of all planned", _planned(tables)),
    )


def _planned(tables: Tables) -> int:
    asked = tables.protocol
    return asked.participants * len(asked.conditions) * len(asked.delays_ms) * len(asked.scenes) * asked.trials


def left_out(tables: Tables) -> Any:
    """Return the trials that do not count, apart from practice: which they are, their status, and the reason."""
    trials = tables.trials[~tables.trials.practice.astype(bool)]
    rows = trials[(trials.status != "complete") | trials.excluded.notna()]
    columns = ["participant", "trial", "attempt", "condition", "delay_ms", "scene", "status", "excluded", "recording"]
    return rows[columns].sort_values(columns[:3]).reset_index(drop=True)


def places(tables: Tables) -> Any:
    """Return a frame: how many participants had each condition (row) in each block (column), as it was run."""
    rows = tables.analysed[["participant", "condition", "block"]].drop_duplicates()
    found = rows.groupby(["condition", "block"]).participant.nunique().unstack(fill_value=0)
    return found.reindex(list(tables.protocol.conditions), fill_value=0)
