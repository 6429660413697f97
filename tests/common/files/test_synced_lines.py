import errno
import os
from pathlib import Path

import pytest

from common.errors import FeelaheadError
from common.files.synced_lines import SyncedLines, complete_lines
from tests.helpers.refusal import refusal


def test_opening_changes_nothing_and_the_next_line_replaces_a_torn_one(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    path.write_bytes(b"one\ntwo\nthr")
    with SyncedLines("--lines", path) as lines:
        assert (lines.lines, lines.torn) == ((b"one\n", b"two\n"), b"thr")
        assert path.read_bytes() == b"one\ntwo\nthr"
        lines.add(b"three")
    assert path.read_bytes() == b"one\ntwo\nthree\n"
    assert complete_lines(b"") == ((), b"")


def test_one_run_at_a_time_writes_also_after_all_lines_were_replaced(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    with SyncedLines("--lines", path) as lines:
        assert "another run writes to it" in refusal(SyncedLines, "--lines", path)
        lines.add(b"one")
        lines.replace([b"two", b"three"])
        assert "another run writes to it" in refusal(SyncedLines, "--lines", path)
        lines.add(b"four")
    assert path.read_bytes() == b"two\nthree\nfour\n"
    assert [*tmp_path.iterdir()] == [path]
    assert "this is no regular file" in refusal(SyncedLines, "--lines", tmp_path)


def test_lines_that_cannot_be_replaced_stay_and_the_file_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "lines"

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with SyncedLines("--lines", path) as lines:
        lines.add(b"one")
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(FeelaheadError, match=r"--lines .*: cannot be written: No space left on device"):
                lines.replace([b"two"])
        assert path.read_bytes() == b"one\n"
        lines.add(b"three")
        lines.replace([b"four"])
    assert path.read_bytes() == b"four\n"
