"""Search for other programs that hold the controller open for writing, on an invented /proc."""

import os
from pathlib import Path

from operator_side.dualsense.hid.second_writer import PERIOD_S, SecondWriters, search_writers, writers_of
from tests.helpers.machines.fake_proc import add_process

NODE = "/dev/hidraw93"
PATH = NODE.encode()
MANY = {f"/var/{number}": os.O_RDWR for number in range(40)}
PERIOD_OF_TURNS_S = 0.004


def test_only_another_process_that_may_write_counts(tmp_path: Path) -> None:
    add_process(tmp_path, 11, "steam", {"/dev/null": os.O_RDWR, NODE: os.O_RDWR})
    add_process(tmp_path, 12, "game", {NODE: os.O_WRONLY})
    add_process(tmp_path, 13, "reader", {NODE: os.O_RDONLY})
    add_process(tmp_path, 14, "elsewhere", {"/dev/hidraw9": os.O_RDWR})
    add_process(tmp_path, 15, "watchdog", {NODE: os.O_RDWR}, parent=os.getpid())
    add_process(tmp_path, os.getpid(), "python", {NODE: os.O_RDWR})
    (tmp_path / "16").mkdir()  # Ended, or another person's.
    (tmp_path / "self").mkdir()
    assert sorted(writers_of(PATH, tmp_path)) == ["game (12)", "steam (11)"]
    assert writers_of(PATH, tmp_path / "nowhere") == []


def test_this_process_is_read_right_where_there_is_a_real_proc(tmp_path: Path) -> None:
    (tmp_path / "hidraw3").touch()
    with (tmp_path / "hidraw3").open("r+"):
        assert writers_of(os.fsencode(tmp_path / "hidraw3")) == []


def test_a_loop_searches_a_little_in_each_turn_and_reports_each_writer_once(tmp_path: Path) -> None:
    add_process(tmp_path, 10, "many", MANY)
    writers = SecondWriters(tmp_path)
    now_s = 0.0

    def looked(seconds: float) -> list[str]:
        nonlocal now_s
        notes = []
        for _ in range(round(seconds / PERIOD_OF_TURNS_S)):
            now_s += PERIOD_OF_TURNS_S
            notes += writers.search(PATH, now_s)
        return notes

    assert looked(1.0) == []
    add_process(tmp_path, 11, "steam", {NODE: os.O_RDWR})
    assert list(search_writers(PATH, tmp_path)).count(None) > len(MANY)  # A turn takes only some of them.
    assert writers.search(None, now_s) == []
    [note] = looked(1.0)
    assert note.startswith("steam (11) holds the controller open for writing, too: ")
    assert "Steam Input" in note
    add_process(tmp_path, 12, "game", {NODE: os.O_RDWR})
    assert looked(PERIOD_S - 1.5) == []
    [note] = looked(2.0)
    assert note.startswith("game (12) ")
    assert looked(2.0 * PERIOD_S) == []
