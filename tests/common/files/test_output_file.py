import errno
import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from common.files.output_file import output_file, require_output_file, write_json


def fill_up(path: Path) -> None:
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


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link = tmp_path / "out.json"
    link.symlink_to(tmp_path / "there" / "real.json")
    write_json("--summary", link, 1)
    write_json("--summary", link, 2)
    assert link.is_symlink()
    assert (tmp_path / "there" / "real.json").read_text() == "2\n"


def test_the_mode_stays(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    path.chmod(0o600)
    write_json("--summary", path, 1)
    assert (path.read_text(), stat.S_IMODE(path.stat().st_mode)) == ("1\n", 0o600)


@pytest.mark.parametrize(("function", "answer"), [("geteuid", 12_345), ("getegid", 12_345), ("access", False)])
def test_another_persons_file_or_one_in_a_folder_of_others_is_written_where_it_is(
    function: str, answer: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    before = path.stat().st_ino
    # Tests may run as root, whom no mode keeps out.
    monkeypatch.setattr(os, function, lambda *_: answer)
    write_json("--summary", path, 1)
    assert (path.read_text(), path.stat().st_ino) == ("1\n", before)


def test_a_file_that_may_not_be_written_is_refused_before_and_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    path.chmod(0o444)
    before = path.stat().st_ino
    # Tests may run as root, whom no mode keeps out.
    monkeypatch.setattr(os, "access", lambda asked, _: Path(asked) != path)
    with pytest.raises(ValueError, match=r"--summary .*out.json: this user may not write to it; valid: "):
        require_output_file("--summary", path)
    if os.geteuid() == 0:
        write_json("--summary", path, 1)
    else:
        with pytest.raises(ConfigurationError, match="Permission denied"):
            write_json("--summary", path, 1)
    assert path.stat().st_ino == before


PRINTS = """
import sys
from pathlib import Path
from common.files.output_file import output_file
print("before")
with output_file("--csv", Path(sys.argv[1])) as file:
    file.write("written\\n")
print("after")
"""


@pytest.mark.processes
@pytest.mark.parametrize("named", ["out.txt", "/dev/stdout", "link"])
def test_what_goes_to_the_output_comes_in_its_turn(named: str, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("/dev/stdout")
    with (tmp_path / "out.txt").open("w") as output:
        subprocess.run([sys.executable, "-c", PRINTS, tmp_path / named], stdout=output, check=True, timeout=600)
    assert (tmp_path / "out.txt").read_text() == "before\nwritten\nafter\n"


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs open files that have names")
def test_an_open_file_with_a_name_of_its_own_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    with path.open("w+") as file:
        write_json("--summary", Path(f"/dev/fd/{file.fileno()}"), 1)
        assert file.read() == "1\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_device_is_written_to_and_not_replaced() -> None:
    with pytest.raises(ConfigurationError, match="No space left on device"):
        write_json("--summary", Path("/dev/full"), 1)
    assert Path("/dev/full").is_char_device()
    write_json("--summary", Path("/dev/null"), 1)
    assert Path("/dev/null").is_char_device()
