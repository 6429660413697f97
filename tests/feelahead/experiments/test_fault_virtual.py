"""Every row of the fault table that virtual time can decide, with its number; and that each guard is needed for one."""

import ast

import pytest

from feelahead.experiments.faults.fault import Fault
from feelahead.experiments.faults.virtual_session_faults import SESSION_FAULTS
from feelahead.experiments.faults.virtual_stream_faults import STREAM_FAULTS
from tests.helpers.repository import ROOT

pytestmark = pytest.mark.long


@pytest.mark.parametrize("fault", [*STREAM_FAULTS, *SESSION_FAULTS], ids=lambda fault: fault.run.__name__)
def test_the_row_holds(fault: Fault) -> None:
    outcome = fault.run()
    assert outcome.safe, outcome.measured


def test_nobody_reads_the_wall_clock() -> None:
    # Not by any of its names: what jumps by an hour must not be there to trip over.
    root = ROOT
    wall_clocks = {"time.time", "time.time_ns", "time.localtime", "time.gmtime", "time.strftime", "time.ctime"}
    for package in ("common", "robot_side", "operator_side"):
        for path in (root / package).rglob("*.py"):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
            imported |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
            assert not imported & {"datetime", "calendar"}, path
            read = {ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
            # A recording's stamps are the wall clock's: it is read once, and for these alone.
            if path == root / "common" / "clock.py":
                read.discard("time.time")
            elif path.parent != root / "common" / "recording":
                assert "wall_clock_offset_s" not in path.read_text(encoding="utf-8"), path
            assert not read & wall_clocks, path
