"""Every row of the fault table that virtual time can decide, with its number; and that each guard is needed for one."""

import pytest

from feelahead.experiments.fault import Fault
from feelahead.experiments.virtual_session_faults import SESSION_FAULTS
from feelahead.experiments.virtual_stream_faults import STREAM_FAULTS


@pytest.mark.parametrize("fault", [*STREAM_FAULTS, *SESSION_FAULTS], ids=lambda fault: fault.run.__name__)
def test_the_row_holds(fault: Fault) -> None:
    outcome = fault.run()
    assert outcome.safe, outcome.measured
