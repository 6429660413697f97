"""Tables of a study: a row for each trial and each answer, from journal and recordings anew."""

from dataclasses import asdict, fields
from pathlib import Path

from common.errors import ConfigurationError
from common.extras import require_packages
from feelahead.printing.progress import progress
from feelahead.study.events import Enrolled
from feelahead.study.folder import TRIALS, read_study
from feelahead.study.progress import NEVER_ARMED
from feelahead.study.records import AnswerRecord, answer_records, participants_of, trial_records, withdrawn
from feelahead.study.report.outcomes import Tables
from feelahead.study.trials.outcome import Outcome, outcome_of


def read_tables(folder: Path) -> Tables:
    """Return the tables of the study in `folder`; ConfigurationError for a folder of none.

    Trials are in the order of participants, plan and attempts. One whose recording cannot be read is excluded.
    """
    require_packages("study", "pandas", extra="study")
    import pandas as pd  # noqa: PLC0415  # large

    protocol, events = read_study(folder)
    records = sorted(trial_records(protocol, events), key=lambda one: (one.participant, not one.practice, one.trial))
    if not records:
        raise ConfigurationError(f"study report {folder}: no trial has begun; valid: a study with trials")
    nothing = dict.fromkeys(field.name for field in fields(Outcome))
    rows = []
    with progress("reading recordings", float(len(records))) as shown:
        for record in records:
            found, why = None, record.excluded
            if record.status == "complete":
                try:
                    found = outcome_of(folder / TRIALS / record.recording, protocol.limit_s)
                except ConfigurationError as error:
                    why = why or str(error).removeprefix(f"{folder / TRIALS}/").partition("; valid: ")[0]
                else:
                    why = why or (NEVER_ARMED if found is None else None)
            rows.append(asdict(record) | {"excluded": why} | (nothing if found is None else asdict(found)))
            shown.advance(1.0)
    answers = [asdict(one) for one in answer_records(protocol, events)]
    columns = [field.name for field in fields(AnswerRecord)]
    enrolled = [event for event in events if isinstance(event, Enrolled)]
    simulated = any(event.simulated for event in enrolled)
    frames = pd.DataFrame(rows), pd.DataFrame(answers, columns=columns)
    return Tables(protocol, *frames, withdrawn(events), participants_of(enrolled), simulated=simulated)
