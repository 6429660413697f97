"""Rows of the fault table that name real processes and signals. Their times belong to the machine: see
`feelahead try faults`; here only that the robot is safe.

Where a busy machine broke the stream by itself each time, before the fault could, that it stands afterwards is
asserted all the same, and the row is skipped as not judged.
"""

import pytest

from feelahead.experiments.faults import real_faults
from feelahead.experiments.faults.fault import Outcome
from feelahead.experiments.faults.first_side import either_side_first
from feelahead.experiments.faults.rig import Rig
from feelahead.experiments.faults.slow_viewer import slow_viewer
from feelahead.experiments.faults.table import REAL_ROWS, Row, try_faults
from feelahead.experiments.faults.unplugged import unplugged

pytestmark = pytest.mark.processes


def nothing() -> None:
    return None


def judge(outcome: Outcome) -> None:
    assert outcome.safe, outcome.measured
    if not outcome.judged:
        pytest.skip(f"not judged: {outcome.measured}")


@pytest.mark.parametrize("row", REAL_ROWS, ids=lambda row: row[0])
def test_the_robot_is_safe(row: Row) -> None:
    _, _, _, run, _ = row
    with Rig() as rig:
        judge(run(rig, 1 if run in (real_faults.robot_stopped, slow_viewer) else 2, nothing))


def test_either_side_may_start_first_and_begins_disarmed() -> None:
    outcome = either_side_first()
    assert outcome.safe, outcome.measured


def test_a_pulled_cable_stops_the_arm() -> None:
    judge(unplugged(2, nothing))


def test_too_few_repetitions_are_refused() -> None:
    with pytest.raises(ValueError, match="repeats"):
        try_faults(["--repeats", "0"])
