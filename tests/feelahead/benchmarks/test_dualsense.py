"""Our driver beside pydualsense on the same simulated reports: what the table says, without its times."""

from pathlib import Path

import pytest

import feelahead.main
from common.errors import ConfigurationError
from feelahead.benchmarks.dualsense.conduct import Conduct
from feelahead.benchmarks.dualsense.ours import Ours
from feelahead.benchmarks.dualsense.peer import PyDualSense
from feelahead.documents.generated_part import BEGIN, END
from operator_side.dualsense.reports.transport import Transport

BOTH = {Transport.USB: True, Transport.BLUETOOTH: True}


@pytest.fixture(scope="module")
def ours() -> Conduct:
    return Ours().examine(1)


def test_ours_reads_right_and_writes_nothing_at_rest(ours: Conduct) -> None:
    assert (ours.axes_right, ours.touch_right) == (BOTH, BOTH)
    assert ours.writes_at_rest_per_s == 0.0
    assert ours.corrupted_refused


def test_ours_leaves_others_parts_alone_and_triggers_released(ours: Conduct) -> None:
    assert not ours.foreign_flags
    assert not ours.debug_codes
    assert ours.released_at_close
    assert "reads on" in ours.after_unplug


def test_the_peer_is_measured_as_it_is() -> None:
    # Its known faults (facts measured before this comparison was made): the player must bring them out.
    theirs = PyDualSense().examine(1)
    assert theirs.axes_right == {Transport.USB: False, Transport.BLUETOOTH: False}
    assert theirs.touch_right == {Transport.USB: True, Transport.BLUETOOTH: False}
    assert theirs.writes_at_rest_per_s == pytest.approx(250.0, rel=0.02)
    assert theirs.debug_codes
    # A thread of its own writes, which on a busy machine may happen to come last, and in time.
    assert not theirs.released_at_close or not all(PyDualSense().examine(1).released_at_close for _ in range(5))


def test_the_table_goes_between_the_marks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    document = tmp_path / "dualsense.md"
    document.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    assert feelahead.main.command(["bench", "dualsense", "--rounds", "1", "--write-docs", str(document)]) == 0
    written = document.read_text()
    assert written.startswith(f"before\n{BEGIN}\n")
    assert "old" not in written
    assert "| writes a second at rest" in written
    assert "writes a second at rest: 0" in capsys.readouterr().out


def test_a_document_without_marks_is_one_line(tmp_path: Path) -> None:
    document = tmp_path / "dualsense.md"
    document.write_text("nothing")
    with pytest.raises(ConfigurationError, match="marks"):
        feelahead.main.command(["bench", "dualsense", "--rounds", "1", "--write-docs", str(document)])
    with pytest.raises(ConfigurationError, match="--rounds 0"):
        feelahead.main.command(["bench", "dualsense", "--rounds", "0"])
