"""Tables of a study: a row for each trial and each answer, from journal and recordings anew."""

from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from common.recording.packages import require_packages
from feelahead.printing.progress import progress
from feelahead.study.folder import TRIALS, read_study
from feelahead.study.protocol import Protocol
from feelahead.study.records import answer_records, trial_records
from feelahead.study.trials.outcome import Outcome, outcome_of

if TYPE_CHECKING:
    import pandas

NEVER_ARMED = "the arm was never armed"


class Tables(NamedTuple):
    """What a study has found."""

    protocol: Protocol
    trials: "pandas.DataFrame"
    """A row for each trial that was begun, in the order of participants, plan and attempts"""
    answers: "pandas.DataFrame"


def read_tables(folder: Path) -> Tables:
    """Return the tables of the study in `folder`; ConfigurationError for a folder of none, or a damaged recording."""
    require_packages("study", "pandas", extra="study")
    import pandas  # noqa: PLC0415  # large

    protocol, events = read_study(folder)
    records = sorted(trial_records(protocol, events), key=lambda one: (one.participant, not one.practice, one.trial))
    nothing = dict.fromkeys(field.name for field in fields(Outcome))
    rows = []
    with progress("reading recordings", float(len(records) or 1)) as shown:
        for record in records:
            row = asdict(record)
            if record.status == "complete":
                found = outcome_of(folder / TRIALS / record.recording, protocol.limit_s)
                row |= nothing if found is None else asdict(found)
                row["excluded"] = row["excluded"] or (NEVER_ARMED if found is None else None)
            else:
                row |= nothing
            rows.append(row)
            shown.advance(1.0)
    answers = [asdict(one) for one in answer_records(protocol, events)]
    return Tables(protocol, pandas.DataFrame(rows), pandas.DataFrame(answers))
