"""Release watchdog as a real process, with a FIFO in place of the controller's device node."""

import contextlib
import os
import select
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

import operator_side.dualsense.hid.release_guard
from operator_side.dualsense.hid.release_guard import MOST_REPLACEMENTS, ReleaseGuard
from operator_side.dualsense.hid.release_watchdog import SILENCE_S, Target, Watch
from tests.helpers.machines.waiting import LIMIT_S, stays, wait_until

pytestmark = pytest.mark.processes
REPORT = bytes(range(48))


class FakeController:
    """FIFO as a device node, from which the test reads what was written."""

    def __init__(self, path: Path) -> None:
        self.path = os.fsencode(path)
        os.mkfifo(path)
        self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK)

    def written(self, within_s: float) -> bytes:
        """Return the bytes written; wait up to `within_s` for the first, and return none if none comes."""
        readable, _, _ = select.select([self._file], [], [], within_s)
        return os.read(self._file, 65536) if readable else b""

    def __enter__(self) -> "FakeController":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)


@pytest.fixture
def controller(tmp_path: Path) -> Iterator[FakeController]:
    with FakeController(tmp_path / "hidraw3") as made:
        yield made


@pytest.fixture
def guard(monkeypatch: pytest.MonkeyPatch) -> Iterator[ReleaseGuard]:
    # Wait, as a busy machine may let the process end late.
    monkeypatch.setattr(operator_side.dualsense.hid.release_guard, "_END_TIMEOUT_S", LIMIT_S)
    with ReleaseGuard() as made:
        yield made


def leave(guard: ReleaseGuard) -> None:
    """Close the watchdog's input, as happens whenever our process ends, and wait until the watchdog ends."""
    guard.__exit__(None, None, None)
    assert guard._process is not None
    assert guard._process.returncode == 0


def process_of(guard: ReleaseGuard) -> int:
    assert guard._process is not None
    return guard._process.pid


def wait_for_end(process_id: int) -> None:
    """Wait until a process that is not our child has ended or is a zombie."""
    try:
        watched = os.pidfd_open(process_id)
    except ProcessLookupError:
        return
    try:
        assert select.select([watched], [], [], LIMIT_S)[0], "the watchdog is an orphan"
    finally:
        os.close(watched)


def test_nothing_is_written_while_the_parent_lives_and_nothing_is_on(
    guard: ReleaseGuard, controller: FakeController
) -> None:
    guard.hold(controller.path, REPORT)
    watchdog = process_of(guard)
    wait_until_open(watchdog, controller.path)
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        os.kill(watchdog, number)
    assert controller.written(0.3) == b""
    leave(guard)
    assert controller.written(LIMIT_S) == REPORT
    assert controller.written(0.0) == b""


def test_when_the_beats_cease_it_releases_once_for_each_silence(
    guard: ReleaseGuard, controller: FakeController
) -> None:
    guard.hold(controller.path, REPORT)
    for _ in range(2):
        guard.beat()
        assert controller.written(LIMIT_S) == REPORT
        assert controller.written(3 * SILENCE_S) == b""
    leave(guard)
    assert controller.written(LIMIT_S) == REPORT


def test_what_it_is_told_in_virtual_time(tmp_path: Path) -> None:
    with FakeController(tmp_path / "hidraw3") as controller, (tmp_path / "answers").open("wb", 0) as answers:
        watched = Watch(answers.fileno())
        hold = f"hold {controller.path.hex()} {REPORT.hex()}".encode()
        watched.execute(b"beat", 1.0)  # Beat of an earlier hold.
        watched.execute(hold, 1.0)
        assert watched.patience_s(1.0) is None
        watched.execute(b"beat", 2.0)
        assert watched.patience_s(2.05) == pytest.approx(SILENCE_S - 0.05)
        assert watched.patience_s(3.0) == 0.0
        watched.execute(b"nonsense", 3.0)
        watched.execute(b"rest", 3.0)
        assert watched.patience_s(3.0) is None
        watched.execute(b"beat", 4.0)
        watched.release()
        assert (controller.written(0.0), watched.patience_s(4.0)) == (REPORT, None)
        watched.execute(b"beat", 5.0)
        watched.execute(b"let-go", 5.0)
        watched.release()
        assert (controller.written(0.0), watched.patience_s(5.0)) == (b"", None)
        watched.execute(b"hold " + bytes(tmp_path / "nothing").hex().encode() + b" 00", 6.0)
        watched.execute(hold, 7.0)  # The newest hold counts.
        watched.execute(b"hold " + os.devnull.encode().hex().encode() + b" 00", 7.0)
        watched.release()
        assert controller.written(0.0) == b""
        assert (tmp_path / "answers").read_bytes() == b"held\nrefused\nheld\nheld\n"


def test_the_path_may_become_another_device_s(guard: ReleaseGuard, controller: FakeController, tmp_path: Path) -> None:
    guard.hold(controller.path, REPORT)
    wait_until_open(process_of(guard), controller.path)
    Path(os.fsdecode(controller.path)).rename(tmp_path / "unplugged")
    with FakeController(Path(os.fsdecode(controller.path))) as keyboard:
        leave(guard)
        assert controller.written(LIMIT_S) == REPORT
        assert keyboard.written(0.0) == b""


def wait_until_open(process_id: int, path: bytes) -> None:
    def is_open() -> bool:
        # While it starts, the process opens and closes other files.
        with contextlib.suppress(FileNotFoundError):
            return any(os.fsencode(file.readlink()) == path for file in Path(f"/proc/{process_id}/fd").iterdir())
        return False

    wait_until(f"{path!r} is open", is_open)


def end_watchdog(guard: ReleaseGuard) -> None:
    watchdog = process_of(guard)
    os.kill(watchdog, signal.SIGKILL)
    wait_for_end(watchdog)


def test_a_watchdog_that_has_ended_is_replaced_and_told_what_is_held(
    guard: ReleaseGuard, controller: FakeController
) -> None:
    guard.hold(controller.path, REPORT)
    first = process_of(guard)
    end_watchdog(guard)
    assert guard.take_notes() == ["the process that would release the triggers has ended; a new one has replaced it"]
    assert guard.take_notes() == []
    assert guard.running
    assert process_of(guard) != first
    leave(guard)
    assert controller.written(LIMIT_S) == REPORT  # By the second watchdog: the trigger was still held when we left.


def test_watchdogs_that_end_again_and_again_are_given_up(guard: ReleaseGuard, controller: FakeController) -> None:
    notes = []
    for _ in range(MOST_REPLACEMENTS + 1):
        end_watchdog(guard)
        notes += guard.take_notes()
    assert len(notes) == MOST_REPLACEMENTS + 1
    assert "is not replaced" in notes[-1]
    assert not guard.running
    guard.hold(controller.path, REPORT)
    guard.beat()
    assert guard.take_notes() == []


def test_a_controller_that_the_watchdog_cannot_open_is_told_of_once(guard: ReleaseGuard, tmp_path: Path) -> None:
    guard.hold(os.fsencode(tmp_path / "nothing"), REPORT)
    [note] = wait_until("a note", lambda: guard.take_notes() or None)
    assert "cannot open the controller" in note
    stays("said again", lambda: guard.take_notes() == [], 0.2)


def test_a_controller_that_refuses_is_tried_a_few_times() -> None:
    attempts = 0

    def refuse(file: int, report: bytes) -> int:
        nonlocal attempts
        attempts += 1
        raise OSError(f"{len(report)} bytes to {file}")

    target = Target(os.fsencode(os.devnull), REPORT)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "write", refuse)
        target.release()
    assert attempts == 3
    target.close()
    target.close()
