"""A study's folder after every kind of end."""

import errno
import os
import random
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import ConfigurationError, FeelaheadError
from common.files import synced_lines
from feelahead.commands.study.people import run_people
from feelahead.study import folder as folder_module
from feelahead.study.events import Begun, Enrolled, Failed, Paused, Withdrew
from feelahead.study.folder import JOURNAL, TRIALS, Study, read_study
from feelahead.study.journal import StudyJournal
from feelahead.study.progress import progress_of
from feelahead.study.protocol import Protocol
from feelahead.study.records import recording_name, trial_records, withdrawn
from feelahead.study.schedule import schedule
from feelahead.study.steps import Done, Practice, Trial, Withdrawn
from feelahead.study.trials.simulated import run_simulated
from tests.feelahead.study.driving import begun, do_all, do_step, end_of, fault_of
from tests.feelahead.study.protocols import protocol
from tests.helpers.refusal import refusal
from tests.helpers.repository import ROOT

TEXT = """
name = "Test"
participants = 2
seed = 7
controller = "keyboard"
scenes = ["wall"]
delays_ms = [0.0]
trials = 2
tlx = false
[conditions.off]
haptics = false
[conditions.felt-ahead]
[practice]
scene = "wall"
condition = "off"
successes = 1
most = 2
[rest]
trials = 3
[[items]]
text = "It helped."
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return _written(tmp_path, TEXT)


def _written(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text)
    return path


def _complete(folder: Path) -> Counter[tuple[int, int]]:
    """Return how often each trial of each participant is complete and counts."""
    of, events = read_study(folder)
    records = trial_records(of, events)
    assert len({(one.participant, one.practice, one.trial, one.attempt) for one in records}) == len(records)
    return Counter((one.participant, one.trial) for one in records if one.excluded is None)


def _once(of: Protocol, participants: int) -> Counter[tuple[int, int]]:
    numbers = range(1, participants + 1)
    return Counter((number, planned.number) for number in numbers for planned in schedule(of, number))


def _some_steps(study: Study, seed: int) -> None:
    """Do two participants' steps, mixed, with faults of every kind."""
    chance = random.Random(seed)  # noqa: S311
    for at_s in range(60):
        number = chance.choice((1, 2))
        step, kind = study.next_step(number), chance.random()
        if isinstance(step, Practice | Trial) and kind < 0.4:
            event = begun(step, number, float(at_s))
            study.add(event)
            study.recording(event).write_text("torn")
            if kind < 0.25:
                study.add(end_of(event) if kind < 0.1 else fault_of(event))
            if kind < 0.05:
                study.add(fault_of(event))
        elif kind > 0.95 and isinstance(step, Trial):
            study.add(Paused(participant=number, at_s=float(at_s)))
        else:
            do_step(study, number, float(at_s))


@settings(max_examples=60)
@given(seed=st.integers(0, 99), share=st.floats(0.0, 1.0))
def test_a_journal_cut_at_any_byte_goes_on_and_no_trial_is_lost_or_done_twice(
    seed: int, share: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)  # Nothing is cut from under it here; each would take milliseconds.
        _cut_and_go_on(seed, share, tmp_path_factory.mktemp("cut"))


def _cut_and_go_on(seed: int, share: float, place: Path) -> None:
    file, folder = _written(place, TEXT), place / "study"
    with Study(folder, file) as study:
        _some_steps(study, seed)
    content = (folder / JOURNAL).read_bytes()
    (folder / JOURNAL).write_bytes(content[: round(share * len(content))])
    begun_at_all = b"\n" in (folder / JOURNAL).read_bytes()
    said = _complete(folder) if begun_at_all else Counter[tuple[int, int]]()
    events = read_study(folder).events if begun_at_all else ()
    happened = {recording_name(event) for event in events if isinstance(event, Begun)}
    for path in (folder / TRIALS).iterdir():
        if path.name.removeprefix("unfinished-") not in happened:
            path.unlink()
    before = {path.name: path.read_bytes() for path in (folder / TRIALS).iterdir()}
    with Study(folder, file) as study:
        whole = _complete(folder)
        for number in (1, 2):
            assert isinstance(do_all(study, number)[-1], Done)
        of = study.protocol
    assert said <= whole <= _complete(folder) == _once(of, 2)
    # What was whole before is there unchanged.
    records = trial_records(*read_study(folder))
    kept = [one.recording for one in records if one.excluded is None and (one.participant, one.trial) in whole]
    assert all((folder / TRIALS / name).read_bytes() == before[name] for name in kept)


def test_a_recording_that_the_journal_does_not_know_is_not_replaced(file: Path, tmp_path: Path) -> None:
    with Study(tmp_path / "study", file) as study:
        do_step(study, 1)
        do_step(study, 1)
        unknown = tmp_path / "study" / TRIALS / "p01-practice001.mcap"
        unknown.write_text("of another folder")
        with pytest.raises(FeelaheadError, match=r"p01-practice001.mcap: is there before its trial"):
            do_step(study, 1)
        assert unknown.read_text() == "of another folder"
        unknown.unlink()
        assert isinstance(do_all(study, 1)[-1], Done)


def test_a_recording_that_became_whole_before_the_end_was_written_counts(file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    with Study(folder, file) as study:
        while not isinstance(step := study.next_step(1), Trial):
            do_step(study, 1)
        event = begun(step, 1, 0.0)
        study.add(event)
        study.recording(event).write_text("whole")
        study.add(end_of(event))
    journal = folder / JOURNAL
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:-1]))
    with Study(folder, file) as study:
        upcoming = study.next_step(1)
        assert isinstance(upcoming, Trial)
        assert (upcoming.planned.number, upcoming.attempt) == (2, 1)
    assert (folder / TRIALS / "p01-t001.mcap").read_text() == "whole"
    assert _complete(folder) == {(1, 1): 1}


@pytest.mark.processes
def test_kill_9_at_any_moment_loses_nothing(file: Path, tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path\n"
        "from feelahead.study.folder import Study\n"
        "from feelahead.study.steps import Done\n"
        "from tests.feelahead.study.driving import do_step\n"
        "with Study(Path(sys.argv[1]), Path(sys.argv[2])) as study:\n"
        "    while not isinstance(do_step(study, 1), Done): print(study.next_step(1), flush=True)\n"
    )
    folder, before = tmp_path / "study", Counter[tuple[int, int]]()
    for lines in (3, 1, 2, 4, 1, 99):
        command = [sys.executable, "-c", code, str(folder), str(file)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT) as child:
            assert child.stdout is not None
            for _ in zip(range(lines), child.stdout, strict=False):
                pass
            child.kill()
        after = _complete(folder)
        assert before <= after
        before = after
    assert before == _once(read_study(folder).protocol, 1)


@pytest.mark.parametrize("written", [0, 1, 20, 9999])
def test_a_full_disk_is_one_line_and_what_it_refused_has_not_happened(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, written: int
) -> None:
    folder = tmp_path / "study"
    with Study(folder, file) as study:
        do_step(study, 1)
        do_step(study, 1)
        step = study.next_step(1)
        assert isinstance(step, Practice)
        event = begun(step, 1, 0.0)

        def full(_: int) -> None:
            with (folder / JOURNAL).open("r+b") as same:
                same.truncate(before + min(written, same.seek(0, os.SEEK_END) - before))
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        before = (folder / JOURNAL).stat().st_size
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(FeelaheadError, match=r"journal .*: cannot be written: No space left on device"):
                study.add(event)
        assert study.next_step(1) == step
        read_study(folder)  # The report reads it as it is.
        assert isinstance(do_all(study, 1)[-1], Done)
    assert _complete(folder) == _once(read_study(folder).protocol, 1)


def test_a_recording_that_is_missing_is_no_end_of_a_trial(file: Path, tmp_path: Path) -> None:
    with Study(tmp_path / "study", file) as study:
        do_step(study, 1)
        do_step(study, 1)
        step = study.next_step(1)
        assert isinstance(step, Practice)
        event = begun(step, 1, 0.0)
        study.add(event)
        with pytest.raises(FeelaheadError, match=r"p01-practice001.mcap: cannot be kept: No such file"):
            study.add(end_of(event))
        study.add(fault_of(event))
        assert isinstance(do_all(study, 1)[-1], Done)


@pytest.mark.parametrize("cut_off", ["", "unlink", "_write", "sync_folder"])
def test_who_withdraws_is_removed_even_if_the_removal_is_cut_off(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut_off: str
) -> None:
    folder = tmp_path / "study"
    with Study(folder, file) as study:
        do_all(study, 1)
        do_all(study, 2)
        (folder / "trials.parquet").write_text("with all")
        gone = Withdrew(participant=1, at_s=9.0, reason="Anna felt sick")
        if cut_off:
            _cut_off(monkeypatch, cut_off)
            with pytest.raises((FeelaheadError, KeyboardInterrupt)):
                study.add(gone)
            monkeypatch.undo()
        else:
            study.add(gone)
            do_step(study, 2)
    with Study(folder, file) as study:
        assert [study.next_step(number) for number in (1, 2)] == [Withdrawn(), Done()]
        [enrolled, last] = [event for event in study.journal.events if event.participant == 1]
        assert isinstance(enrolled, Enrolled)
        assert last == msgspec.structs.replace(gone, reason="")
    of, events = read_study(folder)
    assert {one.participant for one in trial_records(of, events)} == {2}
    assert withdrawn(events) == (1,)
    assert b"Anna" not in (folder / JOURNAL).read_bytes()
    assert {path.name[:3] for path in (folder / TRIALS).iterdir()} == {"p02"}
    assert not (folder / "trials.parquet").exists()
    assert _complete(folder) == {key: 1 for key in _once(of, 2) if key[0] == 2}


def _cut_off(monkeypatch: pytest.MonkeyPatch, where: str) -> None:
    """Let the process end, as by Ctrl-C, in a step of the removal."""

    def ended(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    if where == "_write":
        write = synced_lines._write

        def write_journal(file: object, rest: bytes) -> None:
            if rest.count(b"\n") > 1:
                ended()
            write(file, rest)  # type: ignore[arg-type]

        monkeypatch.setattr(synced_lines, "_write", write_journal)
    elif where == "sync_folder":
        monkeypatch.setattr(folder_module, "sync_folder", ended)
    else:
        monkeypatch.setattr(Path, "unlink", ended)


def test_data_that_stay_are_all_there(tmp_path: Path) -> None:
    file, folder = _written(tmp_path, 'withdrawn = "keep"\n' + TEXT), tmp_path / "study"
    with Study(folder, file) as study:
        do_all(study, 1)
        study.add(Withdrew(participant=1, at_s=9.0, reason="no time"))
    of, events = read_study(folder)
    assert _complete(folder) == _once(of, 1)
    assert events[-1] == Withdrew(participant=1, at_s=9.0, reason="no time")


def test_a_folder_of_something_else_is_refused(file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    with Study(folder, file) as study:
        do_step(study, 1)
        assert "another run writes to it" in refusal(Study, folder, file)
    own = folder / "protocol.toml"
    assert own.read_text() == TEXT
    file.write_text("# The same.\n" + TEXT)
    with Study(folder, file) as study:
        assert study.journal.participants == (1,)
    file.write_text(TEXT.replace("seed = 7", "seed = 8"))
    assert f"valid: {own}, or a new folder" in refusal(Study, folder, file)
    assert "has other files" in refusal(Study, tmp_path, file)
    assert "holds no protocol.toml" in refusal(read_study, tmp_path)
    assert "/proc" in refusal(Study, Path("/proc/study"), file)


@pytest.mark.parametrize("simulated", [False, True])
def test_people_and_simulated_persons_never_share_a_folder(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, simulated: bool
) -> None:
    for name in ("feelahead.study.trials.simulated.processes", "feelahead.commands.study.people.PageServer"):
        monkeypatch.setattr(name, lambda *_: pytest.fail("it has begun"))
    with Study(tmp_path / "study", file) as study:
        study.add(Enrolled(participant=1, at_s=0.0, simulated=simulated))
        runs: tuple[Callable[[], None], ...] = (lambda: run_people(study, None), lambda: run_simulated(study, 2, 1))
        assert "participant 1 is " in refusal(runs[not simulated])
        study.require_all(simulated=simulated)
        assert len(study.journal.events) == 1


@pytest.mark.parametrize("line", [b"{}\n", b"\xff\n", b'{"event": "slept", "participant": 1, "at_s": 0}\n'])
def test_a_damaged_journal_is_told_by_its_line(file: Path, tmp_path: Path, line: bytes) -> None:
    folder = tmp_path / "study"
    with Study(folder, file) as study:
        do_all(study, 1)
    content = (folder / JOURNAL).read_bytes().splitlines(keepends=True)
    (folder / JOURNAL).write_bytes(b"".join([*content[:3], line, *content[3:]]))
    for call, arguments in ((Study, (folder, file)), (read_study, (folder,))):
        assert "line 4 is damaged" in refusal(call, *arguments)
    with pytest.raises(ConfigurationError, match="is of another protocol"):
        StudyJournal(folder / JOURNAL, protocol())


def test_progress_of_a_folder_is_that_of_its_events(file: Path, tmp_path: Path) -> None:
    with Study(tmp_path / "study", file) as study:
        _some_steps(study, 3)
        kept = {number: study.journal.progress(number) for number in (1, 2)}
    events = read_study(tmp_path / "study").events
    assert {number: progress_of(events, number) for number in (1, 2)} == kept
    assert any(isinstance(event, Failed) for event in events)
