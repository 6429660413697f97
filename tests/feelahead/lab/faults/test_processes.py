"""Rows of the fault table that name real processes and signals. Their times belong to the machine: see
`feelahead try faults`; here only that the robot is safe.

Where a busy machine broke the stream by itself each time, before the fault could, that it stands afterwards is
asserted all the same, and the row is skipped as not judged.
"""

import pytest

from feelahead.lab.faults.fault import REAL, Fault
from feelahead.lab.questions import faults

pytestmark = pytest.mark.processes
ONCE = ("robot side stopped 2 s", "slow viewers")
assert faults.ROWS


@pytest.mark.parametrize("fault", REAL.values(), ids=lambda fault: fault.name)
def test_the_robot_is_safe(fault: Fault) -> None:
    outcome = fault.run(1 if fault.name in ONCE else 2)
    assert outcome.safe, outcome.measured
    if not outcome.judged:
        pytest.skip(f"not judged: {outcome.measured}")
