"""Replays: the cores give the same bits, and playback shows the same at each time, by playing or by jumping."""

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader

from common.episode import EpisodeMark
from common.errors import ConfigurationError
from common.protocol import codec
from common.protocol.codec import PROTOCOL_VERSION, decode, encode
from common.protocol.compact import STEP_M
from common.protocol.messages import StiffnessUpdate
from common.recording.entries import Kind, split_text
from common.recording.reading import Recording, open_recording
from common.silence import KEEP_ALIVE_S
from feelahead.both_sides.loopback import Loopback
from feelahead.commands.recordings import replay
from feelahead.recordings import replay_robot as replaying
from feelahead.recordings.comparison import Comparison, recorded_entries
from feelahead.recordings.playback import Playback, Seen, seen
from feelahead.recordings.replay_operator import replay_operator
from feelahead.recordings.replay_robot import replay_robot
from feelahead.recordings.tables import read_tables
from robot_side.compiled.warm_up import kernel_digests
from robot_side.parts import build_parts
from tests.feelahead.recordings.conftest import DURATION_S, record_loopback
from tests.helpers.python_process import ended
from tests.helpers.recordings.schemas import fitting_topics
from tests.helpers.refusal import refusal

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("recorded run")]


def test_the_robot_side_makes_the_same_stiffness_bit_for_bit(run: Recording) -> None:
    compared = replay_robot(run)
    assert compared.made == compared.equal > DURATION_S / KEEP_ALIVE_S
    assert compared.others == compared.others_equal > 0
    assert (compared.worst_eighths, compared.worst_m, compared.notes) == (0.0, 0.0, [])


def test_the_operator_side_sends_and_writes_the_same(run: Recording) -> None:
    compared = replay_operator(run)
    assert compared.made == compared.equal > DURATION_S / KEEP_ALIVE_S
    assert compared.within
    told = [one for one in recorded_entries(run, "operator", []) if one.kind == Kind.TOLD]
    assert len(told) > 10  # The person felt something, or nothing was compared.


ALONE = """
import sys
from pathlib import Path
from common.recording.reading import open_recording
from feelahead.recordings import replay_operator
build, loaded = replay_operator.build_operator_side, set()
def built(*arguments):
    core = build(*arguments)
    loaded.update(sys.modules)
    return core
replay_operator.build_operator_side = built
assert replay_operator.replay_operator(open_recording(Path(sys.argv[1]))).within
assert loaded and "robot_side.core" not in sys.modules
print(*sorted(sys.modules.keys() - loaded))
"""
"""Replay of an operator side, in a process without a robot side; it prints the modules that this loads."""


@pytest.mark.processes
def test_an_operator_side_loads_no_module_while_it_runs(run: Recording) -> None:
    code, said, complaint = ended("-c", ALONE, str(run.path))
    assert (code, said.split()) == (0, []), complaint


def test_a_run_with_episodes_and_the_scene_put_back_is_made_again(tmp_path: Path) -> None:
    def marks(kind: EpisodeMark) -> Callable[[Loopback, float], None]:
        return lambda run, now_s: run.operator.marker.mark(kind, now_s)

    path = tmp_path / "episodes.mcap"
    doing = {
        **{1.0: marks("start"), 2.4: marks("reset"), 2.5: lambda run, now_s: run.operator.press_stop(now_s)},
        **{3.0: marks("failure"), 3.1: marks("reset"), 3.2: marks("start")},
    }
    record_loopback(path, 5.0, doing, link="delay 20ms 5ms", seed=3)
    recording = open_recording(path)

    robot, operator = replay_robot(recording), replay_operator(recording)

    assert robot.made == robot.equal > 0
    assert robot.others == robot.others_equal > 0
    assert operator.made == operator.equal > 0
    shown = [json.loads(message.content) for message in recording.messages(["/episode"])]
    # The first reset was refused, as the arm was armed; the other one counts when the robot side says it is done.
    assert [one["mark"] for one in shown] == ["start", "failure", "reset", "start"]
    assert {one["side"] for one in shown} == {"operator"}
    heard = [one for one in recorded_entries(recording, "robot", []) if one.kind == Kind.EPISODE]
    assert [msgspec.json.decode(one.content) for one in heard] == [one["mark"] for one in shown]
    statuses = {"/robot/status", "/operator/status"}
    assert fitting_topics(path) == {"/stiffness", "/command", "/ages", "/episode", "/truth"} | statuses
    arm = read_tables(recording).table("arm")
    positions = np.stack([arm.numbers(f"position_rad.{joint}") for joint in range(6)], axis=1)
    away = np.abs(positions - positions[0]).max(axis=1)
    times_s = np.array(arm.times_s)
    assert away[times_s < 3.1][-1] > 0.01
    assert away[(times_s > 3.25) & (times_s < 3.4)].max() < 0.005


def test_the_command_says_so_and_another_setting_makes_other_stiffness(
    run: Recording, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert replay([str(run.path), "--check"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == "the same, within the promised tolerance"
    assert "equal bit for bit" in said[0]
    build = build_parts

    def other(settings: Any, *others: Any, **named: Any) -> Any:
        return build(dataclasses.replace(settings, probability=0.9), *others, **named)

    monkeypatch.setattr(replaying, "build_parts", other)
    assert replay([str(run.path), "--check"]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "NOT the same"


def test_other_kernels_are_named(run: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    others = dict.fromkeys(kernel_digests(), "other")
    monkeypatch.setattr(replaying, "kernel_digests", lambda: others)
    assert [
        note for note in replay_robot(run).notes if "kernels" in note and "the last bits of results may differ" in note
    ]
    monkeypatch.setattr(replaying, "kernel_digests", dict)
    with pytest.raises(ConfigurationError, match=r"another version.*works: feelahead replay without --check, export"):
        replay_robot(run)


def test_damage_is_said_and_what_comes_before_is_compared(
    run: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged = tmp_path / "damaged.mcap"
    content = bytearray(run.path.read_bytes())
    with run.path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[len(summary.chunk_indexes) // 2]
    content[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 4
    damaged.write_bytes(content)
    assert replay([str(damaged), "--check"]) == 0
    said = capsys.readouterr()
    assert "robot: the file is damaged: the comparison ends at the damage" in said.out
    assert f"{damaged}: is damaged; " in said.err
    assert 0.0 < open_recording(damaged).length_s() < run.length_s()


def test_a_cut_file_is_compared_up_to_its_last_complete_second_where_there_is_one(
    run: Recording, tmp_path: Path
) -> None:
    cut, content = tmp_path / "cut.mcap", run.path.read_bytes()
    cut.write_bytes(content[: len(content) // 2])
    compared = replay_robot(open_recording(cut))
    assert compared.made == compared.equal > 0.4 * DURATION_S / KEEP_ALIVE_S
    assert compared.notes == ["the file was cut off: the comparison ends at its last complete second"]
    # After the header, with a digest of every kernel imported by then, and before a second is complete.
    cut.write_bytes(content[: content.index(b"feelahead.robot") + len(repr(kernel_digests())) + 3000])
    assert "ends before its first complete second" in refusal(replay, [str(cut), "--check"])


@pytest.mark.parametrize("arguments", [[], ["--check"]])
def test_a_recording_of_another_protocol_is_refused_in_one_line(
    run: Recording, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(codec, "PROTOCOL_VERSION", PROTOCOL_VERSION + 1)
    with pytest.raises(ConfigurationError) as caught:
        replay([str(run.path), *arguments])
    ours, theirs = PROTOCOL_VERSION + 1, PROTOCOL_VERSION
    assert str(caught.value) == f"{run.path}: recorded with protocol version {theirs}; valid: {ours}"


@pytest.mark.parametrize(("side", "again"), [("robot", replay_robot), ("operator", replay_operator)])
def test_a_recording_from_before_the_period_was_a_setting_is_refused_in_one_line(
    run: Recording, side: str, again: Callable[[Recording], Comparison]
) -> None:
    before = {name: value for name, value in run.headers[side]["settings"].items() if name != "tick_period"}
    old = dataclasses.replace(run, headers={side: {**run.headers[side], "settings": before}})
    with pytest.raises(ConfigurationError, match=f"its settings lack tick_period: its {side} side cannot be") as caught:
        again(old)
    assert "\n" not in str(caught.value)


def some_stiffness(run: Recording) -> bytes:
    for one in recorded_entries(run, "robot", []):
        if one.kind == Kind.SENT:
            payload = split_text(split_text(one.content)[1])[1]
            if isinstance(decode(payload), StiffnessUpdate):
                return payload
    raise AssertionError


def test_differences_are_measured(run: Recording) -> None:
    payload = some_stiffness(run)
    message: Any = decode(payload)
    field = message.r2
    ways = (field.fast_m[0] - STEP_M, *field.fast_m[1:])
    closer = msgspec.structs.replace(message, r2=msgspec.structs.replace(field, fast_m=ways))
    compared = Comparison("robot", "messages")
    compared.compare(payload, encode(closer))
    assert (compared.made, compared.equal) == (1, 0)
    assert compared.worst_m == STEP_M
    assert compared.worst_eighths == 0.0
    compared.compare(payload, None)
    assert compared.worst_eighths == math.inf
    assert not compared.within


@pytest.fixture
def recording(with_pictures: tuple[Recording, list[bytes]]) -> Recording:
    return with_pictures[0]


def newest(shown: list[Seen]) -> dict[str, Seen]:
    return {one.name: one for one in shown}


@pytest.mark.parametrize("speed", [0.25, 1.0, 40.0])
def test_it_takes_as_long_as_the_speed_says_and_leaves_nothing_out(recording: Recording, speed: float) -> None:
    playback = Playback(recording, speed)
    assert playback.advance(1.0) == []
    playback.paused = False
    shown, passed_s = [], 0.0
    while not playback.over:
        shown += playback.advance(0.01)
        passed_s += 0.01
    assert shown == list(seen(recording))
    assert passed_s == pytest.approx(playback.length_s / speed, abs=0.011)
    # A stiffness leaves at least that often.
    assert playback.length_s == pytest.approx(shown[-1].time_s, abs=KEEP_ALIVE_S)
    assert playback.paused
    playback.wish({"paused": False, "speed": 1.0})  # From its end it restarts.
    assert playback.state() == {"at_s": 0.0, "length_s": playback.length_s, "speed": 1.0, "paused": False}


@pytest.mark.parametrize("moments_s", [(3.0,), (5.0, 3.0), (1.0, 2.0, 3.0), (0.0, 3.0, 3.0)])
def test_a_moment_looks_the_same_however_it_was_reached(recording: Recording, moments_s: tuple[float, ...]) -> None:
    playback = Playback(recording)
    shown: list[Seen] = []
    for moment_s in moments_s:
        playback.wish({"at_s": moment_s})
        shown += playback.advance(0.02)
    assert newest(shown) == newest([one for one in seen(recording) if one.time_s <= 3.0])
    playback.wish({"paused": False})
    following = playback.advance(0.5)
    assert following == [one for one in seen(recording) if 3.0 < one.time_s <= 3.5]


@pytest.mark.parametrize("words", [None, {"at_s": -1}, {"at_s": float("nan")}, {"speed": 0}, {"paused": 1}, {"x": 1}])
def test_what_is_no_wish_changes_nothing(recording: Recording, words: Any) -> None:
    playback = Playback(recording)
    before = playback.state()
    playback.wish(words)
    assert playback.state() == before


def test_a_later_viewer_sees_the_moment_of_the_pause(recording: Recording) -> None:
    playback = Playback(recording)
    playback.wish({"at_s": 3.0})
    shown = newest(playback.advance(0.02))
    assert playback.advance(0.02) == []
    playback.show_again()
    assert newest(playback.advance(0.02)) == shown
    assert playback.advance(0.02) == []
    playback.wish({"at_s": 1.0})
    playback.show_again()
    assert newest(playback.advance(0.02)) == newest([one for one in seen(recording) if one.time_s <= 1.0])
