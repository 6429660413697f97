"""Files that are written: whole or not at all, and one line where they cannot be."""

import errno
import json
import os
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from common.files.output_file import output_file, write_json


def fill_up(path: Path) -> None:
    """Some of it is written before the disk is full."""
    with output_file("--csv", path) as file:
        file.write("new " * 10_000)
        file.flush()
        raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    path.write_text("old")
    with pytest.raises(ConfigurationError, match=r"--csv .*out.csv: cannot be written: No space left .*; valid: "):
        fill_up(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_new_file_is_there_at_once_and_whole(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    with output_file("--summary", path) as file:
        file.write("new\r\n")
        assert path.read_text() == "old"
    assert path.read_bytes() == b"new\r\n"
    write_json("--summary", path, {"ticks": 1})
    assert json.loads(path.read_text()) == {"ticks": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_of_ours_leaves_the_old_file_too(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    with pytest.raises(TypeError):
        write_json("--summary", path, {"ticks": object()})
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link = tmp_path / "out.json"
    link.symlink_to(tmp_path / "there" / "real.json")
    write_json("--summary", link, 1)
    write_json("--summary", link, 2)
    assert link.is_symlink()
    assert (tmp_path / "there" / "real.json").read_text() == "2\n"


def test_a_file_in_a_folder_of_others_is_written_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    before = path.stat().st_ino
    # Tests may run as root, whom no mode keeps out.
    monkeypatch.setattr(os, "access", lambda *_: False)
    write_json("--summary", path, 1)
    assert (path.read_text(), path.stat().st_ino) == ("1\n", before)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_device_is_written_to_and_not_replaced() -> None:
    with pytest.raises(ConfigurationError, match="No space left on device"):
        write_json("--summary", Path("/dev/full"), 1)
    assert Path("/dev/full").is_char_device()
    write_json("--summary", Path("/dev/null"), 1)
    assert Path("/dev/null").is_char_device()
