import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from common.clock import MonotonicClock
from common.errors import ConfigurationError
from common.recording.entries import Kind, entry, unpack_block
from common.recording.reading import open_recording
from common.recording.recorder import FLUSH_PERIOD_S
from common.recording.side import RecorderProcess, SideRecording
from tests.helpers.machines.waiting import LIMIT_S

pytestmark = pytest.mark.processes


class Bytes:
    """Encoder for a recording whose notes are bytes already."""

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        del views
        now_s, content = noted
        return now_s, entry(Kind.HANDS, now_s, content)

    def begin_epoch(self) -> None:
        """Do nothing, as no note is encoded as a difference from an earlier one."""


def recording_to(path: Path, side: str = "robot") -> SideRecording:
    recording = SideRecording(path, side, Bytes())
    recording.begin({"settings": {}, "epoch": 1, "versions": {}})
    return recording


def numbers(path: Path, side: str = "robot") -> list[int]:
    found = open_recording(path).messages([f"/{side}/inputs"])
    return [int(one.content) for block in found for one in unpack_block(block.content).unpacked()]


def note_until(recording: SideRecording, done: Callable[[], bool]) -> tuple[int, list[str]]:
    """Record the numbers 0, 1, 2 ... in real time until `done`; return their count and the recording's messages."""
    clock = MonotonicClock()
    end_s, count, said = clock.now() + LIMIT_S, 0, []
    while not done():
        assert clock.now() < end_s
        now_s = clock.now()
        recording.noted.append((now_s, str(count).zfill(8).encode()))
        count += 1
        said += recording.idle(now_s)
        time.sleep(1e-3)
    return count, said


def kept_s(recording: SideRecording) -> float:
    return float(recording._said["kept_s"])


def test_a_side_that_is_killed_loses_nothing_that_it_handed_over(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = recording_to(path)
    count, _ = note_until(recording, lambda: kept_s(recording) > 0.0)
    recording.idle(float("inf"))
    assert recording._recorder is not None
    while recording._channel.waiting:  # A message that has not left the process dies with it.
        recording._channel.flush()
    # For a killed process the system does no more than close its descriptors.
    recording._recorder.close()
    assert open_recording(path).whole
    assert numbers(path) == list(range(count))


def test_a_recorder_that_is_killed_leaves_all_but_the_last_second(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = recording_to(path)
    note_until(recording, lambda: kept_s(recording) > 2.0 * FLUSH_PERIOD_S)
    assert recording._recorder is not None
    kept_before_s = kept_s(recording)
    os.kill(recording._recorder.process_id, signal.SIGKILL)
    # The side continues, and reports once what became of the recording.
    _, said = note_until(recording, lambda: recording._channel.ended)
    said += recording.idle(0.0)
    assert [text for text in said if "the recorder has ended" in text] == said
    assert len(said) == 1
    assert recording.close()["error"] == "the recorder was killed"
    found = open_recording(path)
    stamps = [one.log_ns for one in found.messages(["/robot/inputs"])]
    assert not found.whole
    assert (stamps[-1] - stamps[0]) / 1e9 >= kept_before_s - 0.1
    kept = numbers(path)
    assert kept == list(range(len(kept)))


def test_a_deleted_file_stops_the_recording_and_nothing_is_said_to_be_kept(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = recording_to(path)
    note_until(recording, lambda: kept_s(recording) > 0.0)
    path.unlink()
    _, said = note_until(recording, lambda: recording._said["error"] is not None)
    assert [*said, *recording.idle(0.0)] == ["recording stopped: the file was deleted; kept: 0.0 s, 0.0 MB"]
    assert recording.close() == {"dropped_blocks": 0, "kept_s": 0.0, "bytes": 0, "error": "the file was deleted"}


def test_a_recorder_that_stands_still_is_ended_and_what_it_had_written_stays(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = recording_to(path)
    note_until(recording, lambda: kept_s(recording) > 0.0)
    assert recording._recorder is not None
    process_id = recording._recorder.process_id
    os.kill(process_id, signal.SIGSTOP)
    recording.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process_id, 0)
    assert numbers(path)


def test_two_sides_share_one_file(tmp_path: Path) -> None:
    path, place = tmp_path / "run.mcap", tmp_path / "recorder"
    recorder = RecorderProcess(path, place)
    robot, operator = recording_to(place), recording_to(place, "operator")
    counts = [note_until(one, lambda one=one: kept_s(one) > 0.0)[0] for one in (robot, operator)]  # type: ignore[misc]
    assert operator.close()["error"] is None
    # A finished side is independent of the other.
    more, _ = note_until(robot, lambda: kept_s(robot) > FLUSH_PERIOD_S)
    robot.close()
    figures = recorder.finish()
    assert figures["error"] is None
    assert figures["bytes"] == path.stat().st_size
    recording = open_recording(path)
    assert recording.whole
    assert set(recording.headers) == {"robot", "operator"}
    assert numbers(path, "operator") == list(range(counts[1]))
    assert numbers(path) == [*range(counts[0]), *range(more)]


def test_a_recorder_of_two_sides_that_was_killed_is_told_with_what_it_kept(tmp_path: Path) -> None:
    path, place = tmp_path / "run.mcap", tmp_path / "recorder"
    recorder = RecorderProcess(path, place)
    robot = recording_to(place)
    note_until(robot, lambda: kept_s(robot) > FLUSH_PERIOD_S)
    os.kill(recorder.process_id, signal.SIGKILL)
    note_until(robot, lambda: robot._channel.ended)
    robot.close()
    figures = recorder.finish()
    assert figures["error"] == "the recorder was killed"
    assert figures["kept_s"] > 0.0
    assert 0 < figures["bytes"] <= path.stat().st_size


def test_what_a_recorder_has_no_room_for_is_dropped_counted_and_said(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recording = recording_to(path)
    assert recording._recorder is not None
    os.kill(recording._recorder.process_id, signal.SIGSTOP)
    clock, count = MonotonicClock(), 0
    while recording.dropped < 3:
        recording.noted.append((clock.now(), str(count).zfill(300_000).encode()))
        recording.idle(clock.now())
        count += 1
    os.kill(recording._recorder.process_id, signal.SIGCONT)
    note_until(recording, lambda: kept_s(recording) > FLUSH_PERIOD_S)
    assert recording.close()["dropped_blocks"] >= 3
    blocks = [unpack_block(one.content) for one in open_recording(path).messages(["/robot/inputs"])]
    assert blocks[-1].number - len(blocks) + 1 == blocks[-1].dropped >= 3
    (told,) = [one.content for one in open_recording(path).messages(["/log"])]
    assert b"blocks of inputs before this time were not recorded" in told


def test_a_file_that_cannot_be_made_is_told_in_one_line(tmp_path: Path) -> None:
    there = tmp_path / "there.mcap"
    there.touch()
    with pytest.raises(ConfigurationError, match=r"--record .*there\.mcap: File exists"):
        recording_to(there)
    silent = tmp_path / "silent"
    with pytest.raises(ConfigurationError, match="No such file or directory; valid: "):
        recording_to(silent / "run.mcap")
