"""Commands on recordings: bad input is reported in one line, and a recorded demo is replayed to the same bits."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest

from common import extras
from common.errors import ConfigurationError
from common.recording.content import Content
from common.recording.mcap_file import RecordingFile
from common.recording.reading import open_recording
from common.recording.topics import FACTS_TOPIC, TYPES
from common.recording.wire import FORMAT, HEADER, NOTE, as_json, stamped
from feelahead.commands.demo.command import demo
from feelahead.commands.recordings import export, plot, replay
from feelahead.recordings.replay_operator import replay_operator
from feelahead.recordings.replay_robot import replay_robot
from tests.helpers.recordings.schemas import fitting_topics
from tests.helpers.refusal import refusal

COMMANDS = (replay, export, plot)


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_no_recording(command: Callable[[Sequence[str]], int], tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    other.write_bytes(b"something else")
    for arguments, told in (
        ([], "no recording given"),
        ([str(other)], "is no MCAP file"),
        ([str(tmp_path / "missing.mcap")], "cannot be read"),
    ):
        assert told in refusal(command, arguments)


def test_wrong_content_in_a_right_file_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    file = RecordingFile(path, 0.0)
    Content(file).write(0, HEADER + as_json({"side": "robot"}))
    file.write("/robot/inputs", 0.0, b"no block")
    file.close()
    for command in COMMANDS[1:]:
        assert "odd.mcap: " in refusal(command, [str(path), "--out", str(tmp_path / f"{command.__name__}.png")])


DEEP = b'{"a":' * 50_000 + b"1" + b"}" * 50_000
WIDE = as_json({f"c{number}": 1.0 for number in range(5001)})


@pytest.mark.parametrize(
    ("messages", "told"),
    [
        ({0.0: DEEP}, "odd.mcap: is no valid recording (RecursionError"),
        ({0.0: WIDE}, "a topic has 5001 columns; valid: at most 5000"),
        ({0.0: b"{}", 80_000.0: b"{}"}, "spans 80000 s with 2 messages; valid: a message or more for each 100 rows"),
    ],
)
def test_a_small_recording_of_a_large_table_is_refused(
    tmp_path: Path, messages: Mapping[float, bytes], told: str
) -> None:
    path = tmp_path / "odd.mcap"
    file = RecordingFile(path, 0.0)
    Content(file).write(0, HEADER + as_json({"side": "robot", "settings": {}}))
    for now_s, content in messages.items():
        file.write("/stiffness", now_s, content)
    file.close()
    for command in COMMANDS[1:]:
        assert told in refusal(command, [str(path), "--out", str(tmp_path / f"{command.__name__}.png")])


@pytest.mark.parametrize("text", ["[" * 100_000, "1" * 5_000])
def test_a_header_that_is_no_json_is_a_text(tmp_path: Path, text: str) -> None:
    path = tmp_path / "odd.mcap"
    file = RecordingFile(path, 0.0)
    file.describe("feelahead.robot", {"format": str(FORMAT), "settings": text})
    file.write("/stiffness", 0.0, b"{}")
    file.close()
    assert open_recording(path).headers["robot"]["settings"] == text


def test_a_recording_with_nothing_for_a_command_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.mcap"
    file = RecordingFile(path, 0.0)
    content = Content(file)
    content.write(0, HEADER + as_json({"side": "robot", "settings": {}, "epoch": 1, "clock_domain": ""}))
    content.write(0, NOTE + stamped(1.0) + b"listening")
    file.close()
    asked = [(one, [str(path)]) for one in COMMANDS]
    for command, arguments in (*asked, (replay, [str(path), "--check"])):
        told = refusal(command, arguments)
        assert "notes.mcap: has only messages of /log; valid: with one at least of /" in told


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("run.txt", "ends in .mcap"),
        ("missing/run.mcap", "its folder does not exist"),
        ("there.mcap", "exists already; valid: the path of a new file"),
    ],
)
def test_where_nothing_can_be_recorded(tmp_path: Path, name: str, told: str) -> None:
    (tmp_path / "there.mcap").write_bytes(b"precious")
    assert told in refusal(demo, ["--record", str(tmp_path / name)])
    assert (tmp_path / "there.mcap").read_bytes() == b"precious"


def test_without_the_extra_the_command_that_mends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda _: None)
    for command, arguments in ((demo, ["--record", str(tmp_path / "run.mcap")]), (replay, ["run.mcap"])):
        with pytest.raises(ConfigurationError, match=r"pip install '.\[record\]'"):
            command(arguments)


@pytest.mark.processes
def test_a_real_run_is_computed_anew_to_the_same_bits(tmp_path: Path) -> None:
    path, summary = tmp_path / "run.mcap", tmp_path / "summary.json"
    arguments = ["--duration", "2", "--record", str(path), "--summary", str(summary), "--status", "none"]
    assert demo([*arguments, "--link", "delay 20ms 5ms"]) == 0
    told = json.loads(summary.read_text())
    kept = told["recording"]
    assert (kept["error"], kept["dropped_blocks"], kept["bytes"]) == (None, 0, path.stat().st_size)
    recording = open_recording(path)
    assert recording.whole
    assert set(recording.headers) == {"robot", "operator"}
    assert fitting_topics(path) == {*TYPES, FACTS_TOPIC} - {"/episode", "/unseen"}
    robot, operator = replay_robot(recording), replay_operator(recording)
    assert robot.made == robot.equal == told["messages"]["stiffness_sent"] > 0
    assert operator.made == operator.equal > 0
    assert robot.notes == operator.notes == []
