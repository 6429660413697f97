"""The engine gives the same table with any workers and after any interruption, and says why it cannot continue."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import weakref
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyarrow import parquet

from common.errors import ConfigurationError
from feelahead.commands.bench_and_try import try_out
from feelahead.lab import pieces
from feelahead.lab.intervals import mcnemar_p, mean_interval, share_interval, student_interval, welch_interval
from feelahead.lab.journal import Journal
from feelahead.lab.pieces import Piece, results
from feelahead.lab.sweep import ask, generator, sweep
from feelahead.printing.progress import Shown
from tests.feelahead.lab import counting
from tests.feelahead.lab.clusters import dask_cluster
from tests.feelahead.lab.counting import QUESTION, TIMED, Cell, Counting, held
from tests.helpers.machines.waiting import LIMIT_S, wait_until
from tests.helpers.repository import ROOT

_GRID = ("--numbers", "1", "2", "3", "4", "--seeds", "3")
_DRIVER = "import sys; from feelahead.lab.sweep import ask; from tests.feelahead.lab.counting import QUESTION; "


def _asked(tmp_path: Path, *arguments: str, name: str = "rows.csv") -> bytes:
    path = tmp_path / name
    assert ask(QUESTION, [*_GRID, *arguments, "--csv", str(path)]) == 0
    return path.read_bytes()


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return _asked(tmp_path_factory.mktemp("expected"), "--workers", "1")


def _lines(journal: Path) -> int:
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def _without_folder(content: bytes) -> list[list[str]]:
    return [[row[0], *row[2:]] for row in csv.reader(content.decode().splitlines())]


def test_rows_stand_in_the_order_of_the_grid_with_cells_and_seeds_as_columns(expected: bytes) -> None:
    rows = list(csv.DictReader(expected.decode().splitlines()))
    assert list(rows[0]) == ["number", "folder", "seed", "part", "value", "none"]
    keys = [(int(row["number"]), int(row["seed"]), int(row["part"])) for row in rows]
    assert keys == sorted(keys)
    assert len(keys) == 4 * 3 * 2


def test_a_cell_draws_the_same_numbers_whatever_else_the_grid_holds(tmp_path: Path, expected: bytes) -> None:
    path = tmp_path / "rows.csv"
    assert ask(QUESTION, ["--numbers", "3", "--seed", "1", "--workers", "1", "--csv", str(path)]) == 0
    assert set(path.read_text().splitlines()[1:]) < set(expected.decode().splitlines())
    assert generator(Cell(1, ""), 0).random() != generator(Cell(2, ""), 0).random()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_journal_cut_anywhere_gives_the_same_table(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("cut")
    path = folder / "journal.jsonl"
    grid = Counting(numbers=(1, 2), seeds=2, workers=1, resume=path)
    whole = sweep(QUESTION, grid).table
    content = path.read_bytes()
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    again = sweep(QUESTION, grid)
    assert list(again.table) == list(whole)
    assert (again.failures, again.left, again.ended) == ([], 0, None)
    # All pieces are there again, none twice.
    assert sorted(path.read_bytes().splitlines()) == sorted(content.splitlines())


def test_only_missing_cells_are_run_and_a_larger_grid_goes_on(tmp_path: Path) -> None:
    cells = tmp_path / "cells"
    cells.mkdir()
    grid = ["--numbers", "1", "2", "--folder", str(cells), "--workers", "1", "--resume", str(tmp_path / "journal")]
    assert ask(QUESTION, grid) == 0
    for done in cells.iterdir():
        done.write_text("refuse")
    assert ask(QUESTION, [*grid, "--seeds", "2"]) == 0
    assert {done.name: done.read_text() for done in cells.iterdir()} == {
        **{"1-0": "refuse", "2-0": "refuse"},
        **{"1-1": "done", "2-1": "done"},
    }


@pytest.mark.parametrize("content", ["notes of mine\n", "notes of mine", '{"a": 1}\n', '{"made_by": 3}\n', "[]\n"])
def test_a_file_that_is_no_journal_is_refused_and_left_as_it_is(tmp_path: Path, content: str) -> None:
    path = tmp_path / "mine.txt"
    path.write_text(content)
    with pytest.raises(ConfigurationError, match=r"--resume .*: (it holds no journal|it was written by another)"):
        ask(QUESTION, ["--resume", str(path), "--workers", "1"])
    assert path.read_text() == content


def test_a_journal_of_other_code_or_one_in_use_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    with Journal(path, {"code": "older"}), pytest.raises(ConfigurationError, match="another run writes to it"):
        ask(QUESTION, ["--resume", str(path)])
    with pytest.raises(ConfigurationError, match="it was written by another question and code"):
        ask(QUESTION, ["--resume", str(path), "--workers", "1"])


def test_one_failed_cell_loses_no_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "2-0").write_text("fail")
    grid = ["--folder", str(tmp_path), "--workers", "1", "--resume", str(tmp_path / "journal")]
    assert ask(QUESTION, grid) == 1
    said = capsys.readouterr().out
    assert "4 rows" in said
    assert re.search(r"failed: number 2, .*, seed 0: as asked\n", said)
    # It is tried again next time, and now succeeds.
    assert ask(QUESTION, grid) == 0


def test_bad_input_ends_the_sweep_at_once(tmp_path: Path) -> None:
    (tmp_path / "1-0").write_text("refuse")
    with pytest.raises(ConfigurationError, match="as asked"):
        ask(QUESTION, ["--folder", str(tmp_path), "--workers", "1"])
    assert not (tmp_path / "2-0").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--workers", "2"], "--workers 2: try counting measures time"),
        (["--scheduler", "tcp://127.0.0.1:1"], "--scheduler tcp://127.0.0.1:1: try counting measures time"),
        (["--scheduler", ""], "--scheduler '': is no address; valid: an address such as tcp://127.0.0.1:8786"),
        (["--picture", "/a.png"], "--picture /a.png: try counting has no figure"),
        (["--workers", "0"], "--workers = 0; valid: at least 1"),
        (["--seeds", "1000000000000"], "3 cells with 1000000000000 seeds each; valid: one value or more"),
        (["--numbers"], "0 cells with 1 seeds each; valid: one value or more"),
        (["--csv", "/nowhere/a.csv"], "--csv /nowhere/a.csv: is a folder, or lies in a folder that does not exist"),
        (["--csv", "a", "--resume", "a"], "--csv a: --resume writes to"),
        (["--csv", "a", "--summary", "a.json"], "--summary a.json: --csv writes to"),
        (["--parquet", "pipe"], "--parquet pipe: this is no regular file"),
    ],
)
def test_what_cannot_be_would_lose_work_or_never_end_is_refused_in_a_line(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    with pytest.raises(ConfigurationError, match=re.escape(said)):
        ask(TIMED, arguments)
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


def test_all_files_hold_the_same_rows_and_the_settings_stand_beside_them(tmp_path: Path, expected: bytes) -> None:
    files = {name: tmp_path / name for name in ("a.csv", "a.parquet", "a.json")}
    flags = ["--csv", "a.csv", "--parquet", "a.parquet", "--summary", "a.json"]
    arguments = [str(files.get(flag, flag)) for flag in flags]
    assert ask(QUESTION, [*_GRID, *arguments, "--workers", "1"]) == 0
    assert files["a.csv"].read_bytes() == expected
    rows = json.loads(files["a.json"].read_text())["runs"]
    assert rows[0]["parts"] == [1, 2]
    scalars = [{name: value for name, value in row.items() if name != "parts"} for row in rows]
    assert parquet.read_table(files["a.parquet"]).to_pylist() == scalars
    beside = json.loads((tmp_path / "a.csv.json").read_text())
    assert beside["settings"]["numbers"] == [1, 2, 3, 4]
    assert {"versions", "code", "frozen", "question"} <= beside.keys()


def test_intervals_of_few_and_of_equal_values_are_told_apart() -> None:
    # Clopper and Pearson: 1 - 0.025^(1/10) for none of ten.
    assert share_interval(0, 10) == pytest.approx((0.0, 1.0 - 0.025**0.1))
    # Six lose it and none gains it: 2 / 2^6.
    assert mcnemar_p([True] * 6 + [False] * 4, [False] * 10) == pytest.approx(2.0 / 2**6)
    assert mcnemar_p([True, False], [True, False]) == 1.0
    assert mean_interval([2.0, 2.0]) == student_interval([2.0, 2.0]) == (2.0, 2.0)
    assert student_interval([1.0]) is welch_interval([1.0], [1.0, 2.0]) is None
    # By hand: sd √2 over √2, and t of one degree of freedom, 12.7062.
    assert student_interval([0.0, 2.0]) == pytest.approx((1.0 - 12.7062, 1.0 + 12.7062), rel=1e-5)
    assert welch_interval([0.0, 0.0], [1.0, 1.0]) == (1.0, 1.0)
    noise = np.random.default_rng(1).normal(size=30)
    low, high = mean_interval(noise.tolist())
    assert high - low == pytest.approx(2 * 1.96 * noise.std() / np.sqrt(30), rel=0.1)


def test_the_example_of_the_readme_runs_and_is_short(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / "feelahead" / "lab" / "README.md").read_text(encoding="utf-8")
    code = text.partition("```python\n")[2].partition("```")[0]
    assert len(code.splitlines()) <= 40
    path = tmp_path / "reordered_example.py"
    path.write_text(code)
    assert try_out([str(path), "--seeds", "2", "--workers", "1", "--csv", str(tmp_path / "rows.csv")]) == 0
    assert "overtaken, of 1000" in capsys.readouterr().out
    rows = list(csv.DictReader((tmp_path / "rows.csv").read_text().splitlines()))
    assert [row["overtaken"] == "0" for row in rows] == [True, True] + [False] * 6


# Killed processes


def _drive(arguments: Sequence[str]) -> "subprocess.Popen[str]":
    call = f"{_DRIVER} sys.exit(ask(QUESTION, {list(arguments)!r}))"
    return subprocess.Popen([sys.executable, "-c", call], cwd=ROOT, text=True, stderr=subprocess.PIPE)


@pytest.mark.processes
def test_a_worker_that_is_killed_leaves_what_is_finished(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "3-2").write_text("kill")
    rows = tmp_path / "rows.csv"
    assert ask(QUESTION, [*_GRID, "--folder", str(tmp_path), "--workers", "2", "--csv", str(rows)]) == 1
    said = capsys.readouterr()
    finished = len(rows.read_text().splitlines()) - 1
    assert 0 < finished < 24
    assert f"{finished} rows" in said.out
    [line] = said.err.splitlines()
    assert re.fullmatch(
        r"feelahead try counting: a worker process ended unexpectedly \(killed, or out of memory\);"
        r" \d+ runs are left; .*--resume FILE.*",
        line,
    )


@pytest.mark.processes
def test_ctrl_c_ends_with_130_and_says_how_to_go_on(tmp_path: Path, expected: bytes) -> None:
    rows, kept = tmp_path / "rows.csv", tmp_path / "journal"
    grid = [*_GRID, "--folder", str(tmp_path), "--resume", str(kept), "--csv", str(rows)]
    held(tmp_path, 4).touch()
    with _drive([*grid, "--workers", "2"]) as driver:
        wait_until("a cell", lambda: _lines(kept) > 1, LIMIT_S)
        driver.send_signal(signal.SIGINT)
        _, complaint = driver.communicate(timeout=LIMIT_S)
    assert driver.returncode == 130
    [line] = complaint.splitlines()
    assert re.search(r": interrupted; \d+ of 12 runs are finished; \d+ runs are left; ", line)
    assert f"to continue, run the same command with --resume {kept}" in line
    assert rows.exists()
    held(tmp_path, 4).unlink()
    assert _without_folder(_asked(tmp_path, *grid[len(_GRID) : -2])) == _without_folder(expected)


@pytest.mark.parametrize("order", ["fail", "done"])
def test_a_table_that_needs_all_rows_hides_neither_how_a_sweep_ended_nor_a_fault_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], order: str
) -> None:
    def needs_all(*_: object) -> list[str]:
        return [{"first": "row"}["second"]]

    question = replace(QUESTION, show=needs_all, draw=needs_all)
    grid = ["--numbers", "1", "2", "--folder", str(tmp_path), "--workers", "1", "--picture", str(tmp_path / "p.png")]
    (tmp_path / "2-0").write_text(order)
    if order == "done":
        with pytest.raises(KeyError):
            ask(question, grid)
        return
    assert ask(question, grid) == 1
    said = capsys.readouterr()
    for what in ("tables", "figure"):
        assert f"the {what} cannot be made without the rows that are missing (KeyError: 'second')" in said.err
    assert "failed: number 2" in said.out


def test_no_moment_loses_a_stop_signal(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Dropping(Shown):
        """Progress that gets the signal while an object is dropped, where an exception would be lost."""

        def begin(self, piece: str) -> None:
            if piece == str(todo[1]):
                held(tmp_path, 2).unlink()
                return
            dropped = {1}
            self._reference = weakref.ref(dropped, lambda _: signal.raise_signal(signal.SIGINT))
            del dropped

    monkeypatch.setattr(pieces, "processes", ThreadPoolExecutor)
    held(tmp_path, 2).touch()
    todo = [Piece(Cell(number, str(tmp_path)), 0) for number in (1, 2)]
    with pytest.raises(KeyboardInterrupt):
        list(results(QUESTION, Counting(workers=2), todo, Dropping("counting", 2.0, None)))


@pytest.mark.processes
def test_whatever_is_killed_costs_no_row_and_a_file_of_ones_own_runs_on_a_cluster_that_does_not_have_it(
    tmp_path: Path, expected: bytes
) -> None:
    def begun(journal: str) -> "subprocess.Popen[str]":
        """Start a run, or go on with it; return it once it has noted another cell."""
        path = tmp_path / journal
        before = max(_lines(path), 1)
        driver = _drive([*_GRID, "--folder", str(tmp_path), "--resume", str(path), "--scheduler", address])
        wait_until("a cell", lambda: _lines(path) > before, LIMIT_S)
        return driver

    def ended(driver: "subprocess.Popen[str]") -> tuple[int, str]:
        _, complaint = driver.communicate(timeout=LIMIT_S)
        return driver.returncode, complaint

    shutil.copy(counting.__file__, tmp_path / "mine_counted.py")
    # One worker may still wait in a cell of the killed driver, and one in the same cell of the next.
    with dask_cluster(3) as (address, (scheduler, worker, *_)):
        call = [sys.executable, "-m", "feelahead", "try", "./mine_counted.py", *_GRID, "--scheduler", address]
        for _ in range(2):  # A cluster accepts the same file twice.
            surroundings = {**os.environ, "PYTHONPATH": str(ROOT)}
            with subprocess.Popen(
                [*call, "--csv", "rows.csv"], cwd=tmp_path, env=surroundings, stderr=subprocess.PIPE, text=True
            ) as own:
                assert ended(own) == (0, "")
            assert (tmp_path / "rows.csv").read_bytes() == expected
        held(tmp_path, 4).touch()
        driver = begun("one")
        driver.kill()
        assert ended(driver)[0] == -signal.SIGKILL
        held(tmp_path, 4).rename(held(tmp_path, 3))
        driver = begun("one")
        worker.kill()
        held(tmp_path, 3).unlink()
        assert ended(driver) == (0, "")
        held(tmp_path, 4).touch()
        driver = begun("two")
        scheduler.kill()
        code, complaint = ended(driver)
        assert code == 1
        assert "the scheduler or its workers are gone; " in complaint
        held(tmp_path, 4).unlink()
    for journal in ("one", "two"):
        resumed = _asked(tmp_path, "--folder", str(tmp_path), "--resume", str(tmp_path / journal), "--workers", "1")
        assert _without_folder(resumed) == _without_folder(expected)


@pytest.mark.processes
def test_a_scheduler_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("feelahead.lab.cluster._CONNECT_S", "1s")
    with pytest.raises(ConfigurationError, match=r"--scheduler tcp://127\.0\.0\.1:1: no dask scheduler answers there"):
        ask(QUESTION, ["--scheduler", "tcp://127.0.0.1:1"])


@pytest.mark.parametrize(
    ("name", "code", "said"),
    [
        ("json.py", "QUESTION = 3", "already has a module of this name"),
        ("own_number.py", "QUESTION = 3", "the file defines no QUESTION"),
        ("own_import.py", "from feelahead.lab.sweep import Questio", "cannot import name 'Questio'"),
        ("own_syntax.py", "QUESTION =", "invalid syntax"),
    ],
)
def test_a_file_that_holds_no_question_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, code: str, said: str
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])  # else json.py is found by the worker processes of later tests
    (tmp_path / name).write_text(code)
    with pytest.raises(ConfigurationError, match=said):
        try_out([str(tmp_path / name)])


def test_a_disk_that_takes_no_more_is_named_and_what_is_finished_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, rows = tmp_path / "journal", tmp_path / "rows.csv"
    synced = iter(range(2))

    def full(_: int) -> None:
        if next(synced, None) is None:
            raise OSError(28, "No space left on device")

    grid = ["--workers", "1", "--resume", str(path), "--csv", str(rows)]
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert ask(QUESTION, grid) == 1
    said = capsys.readouterr()
    assert "4 rows" in said.out
    assert len(rows.read_text().splitlines()) == 5
    [line] = said.err.splitlines()
    assert f"--resume {path}: cannot be written: No space left on device; 1 runs are left; to continue, " in line
    assert ask(QUESTION, grid) == 0


def test_ctrl_c_before_the_first_cell_is_one_line_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("feelahead.commands.bench_and_try.import_module", interrupted)
    assert try_out(["demo"]) == 130
    assert capsys.readouterr().err == "feelahead try demo: interrupted\n"


def test_a_table_that_cannot_be_written_is_still_shown(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ConfigurationError, match=r"--csv /dev/full: cannot be written: No space left"):
        ask(QUESTION, ["--workers", "1", "--csv", "/dev/full"])
    assert "6 rows" in capsys.readouterr().out
