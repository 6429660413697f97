"""Rows of the fault table that name real processes and signals. Their times belong to the machine: see
`feelahead try faults`; here only that the robot is safe.
"""

from collections.abc import Iterator

import pytest

from feelahead.experiments.faults import real_faults
from feelahead.experiments.faults.first_side import either_side_first
from feelahead.experiments.faults.rig import Rig
from feelahead.experiments.faults.table import REAL_ROWS, Row, try_faults
from feelahead.experiments.faults.unplugged import unplugged

pytestmark = pytest.mark.processes


def nothing() -> None:
    return None


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with Rig() as running:
        yield running


@pytest.mark.parametrize("row", REAL_ROWS, ids=lambda row: row[0])
def test_the_robot_is_safe(rig: Rig, row: Row) -> None:
    _, _, _, run, _ = row
    outcome = run(rig, 1 if run is real_faults.robot_stopped else 2, nothing)
    assert outcome.safe, outcome.measured


def test_either_side_may_start_first_and_begins_disarmed() -> None:
    outcome = either_side_first()
    assert outcome.safe, outcome.measured


def test_a_pulled_cable_stops_the_arm() -> None:
    outcome = unplugged(2, nothing)
    if outcome.measured.startswith("skipped"):
        pytest.skip(outcome.measured)
    assert outcome.safe, outcome.measured


def test_too_few_repetitions_are_refused() -> None:
    with pytest.raises(ValueError, match="repeats"):
        try_faults(["--repeats", "0"])
