"""The cores once more: from the recorded inputs come the same bits, and a difference is found and told."""

import dataclasses
import shutil
from pathlib import Path
from typing import Any

import msgspec
import pytest

from common.errors import ConfigurationError
from common.protocol.codec import decode, encode
from common.protocol.messages import StiffnessUpdate
from common.recording.entries import Kind, split_text
from common.recording.reading import Recording, open_recording
from feelahead.commands.recordings import replay
from feelahead.recordings import replay as replaying
from feelahead.recordings.comparison import Comparison, recorded_entries
from feelahead.recordings.replay import replay_operator, replay_robot
from robot_side.assembly import assemble

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("recorded run")]


def test_the_robot_side_makes_the_same_stiffness_bit_for_bit(run: Recording) -> None:
    compared = replay_robot(run)
    assert compared.made == compared.equal > 5000
    assert compared.others == compared.others_equal > 0
    assert (compared.worst_eighths, compared.worst_m, compared.notes) == (0.0, 0.0, [])


def test_the_operator_side_sends_and_writes_the_same(run: Recording) -> None:
    compared = replay_operator(run)
    assert compared.made == compared.equal > 1000
    assert compared.within
    written = [one for one in recorded_entries(run, "operator", []) if one.kind == Kind.WRITTEN]
    assert len(written) > 10  # the person felt something, or nothing was compared


def test_the_command_says_so(run: Recording, capsys: pytest.CaptureFixture[str]) -> None:
    assert replay([str(run.path), "--check"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == "the same, within what is promised"
    assert "equal bit for bit" in said[0]


def test_another_setting_makes_other_stiffness(
    run: Recording, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    build = assemble

    def other(settings: Any, *others: Any, **named: Any) -> Any:
        return build(dataclasses.replace(settings, probability=0.9), *others, **named)

    monkeypatch.setattr(replaying, "assemble", other)
    assert replay([str(run.path), "--check"]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "NOT the same"


def test_other_kernels_are_named(run: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replaying, "kernel_digests", dict)
    assert [note for note in replay_robot(run).notes if "kernels" in note and "bits may differ" in note]


def test_a_cut_file_is_compared_up_to_its_last_complete_second(run: Recording, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    shutil.copy(run.path, cut)
    with cut.open("r+b") as file:
        file.truncate(run.path.stat().st_size // 2)
    compared = replay_robot(open_recording(cut))
    assert compared.made == compared.equal > 1000
    assert compared.notes == ["the file was cut off: compared up to its last complete second"]


def test_damage_is_said_and_what_comes_before_is_compared(
    run: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged = tmp_path / "damaged.mcap"
    content = bytearray(run.path.read_bytes())
    content[len(content) // 3] ^= 4
    damaged.write_bytes(content)
    assert replay([str(damaged), "--check"]) == 0
    said = capsys.readouterr()
    assert "robot: the file is damaged: compared up to there" in said.out
    assert f"{damaged}: is damaged; what can be read of it: " in said.err
    assert 0.0 < open_recording(damaged).length_s() < run.length_s()


def test_nothing_to_compare_is_not_the_same(run: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    short = tmp_path / "short.mcap"
    content = run.path.read_bytes()
    short.write_bytes(content[: content.index(b"feelahead.robot") + 5000])
    assert replay([str(short), "--check"]) == 1
    assert "nothing was compared" in capsys.readouterr().out


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
    ways = (field.fast_m[0] - 1e-13, *field.fast_m[1:])
    closer = msgspec.structs.replace(message, r2=msgspec.structs.replace(field, fast_m=ways))
    compared = Comparison("robot", "messages")
    compared.take(payload, encode(closer))
    assert (compared.made, compared.equal) == (1, 0)
    assert 0.0 < compared.worst_m < 2e-13
    assert compared.within
    compared.take(payload, None)
    assert not compared.within


def test_a_side_that_was_not_recorded(run: Recording) -> None:
    alone = dataclasses.replace(run, headers={"robot": run.headers["robot"]})
    with pytest.raises(ConfigurationError, match="the operator side was not recorded; valid: robot"):
        replay_operator(alone)
