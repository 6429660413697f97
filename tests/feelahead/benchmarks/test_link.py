"""`feelahead bench link`, in virtual time, and once for real over loopback."""

import csv
import math
from pathlib import Path

import pytest

import feelahead.main
from common.emulation.trace import Trace
from common.errors import ConfigurationError
from tests.helpers.repository import DATA

BENCH = ["bench", "link"]


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_message_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "sample.csv"
    arguments = ["--virtual", "--link", "delay 50ms loss 10%", "--count", "500", "--csv", str(path)]
    assert feelahead.main.command([*BENCH, *arguments]) == 0
    said = capsys.readouterr().out
    assert "asked delay 50ms loss 10%" in said
    written = rows(path)
    assert [int(row["seq"]) for row in written] == list(range(500))
    assert [int(row["sent_ns"]) for row in written] == [number * 1_000_000 for number in range(500)]
    delays_ns = {int(row["received_ns"]) - int(row["sent_ns"]) for row in written if row["received_ns"]}
    assert delays_ns == {50_000_000}
    lost = [row["received_ns"] == "" for row in written]
    assert sum(lost) == pytest.approx(50, abs=20)
    # What the benchmark writes, a link can replay.
    assert [delay_s is None for delay_s in Trace.read(path, "trace").delays_s] == lost


def test_virtual_runs_repeat_by_seed(tmp_path: Path) -> None:
    def sample(seed: int) -> str:
        path = tmp_path / f"{seed}.csv"
        arguments = ["--virtual", "--count", "300", "--seed", str(seed), "--csv", str(path)]
        feelahead.main.command([*BENCH, *arguments])
        return path.read_text()

    assert sample(1) == sample(1)
    assert sample(1) != sample(2)


def test_send_times_come_from_a_recording(tmp_path: Path) -> None:
    sends, path = tmp_path / "sends.csv", tmp_path / "sample.csv"
    sends.write_text("seq,sent_ns,delay_ns\n1,7000000,1\n0,0,1\n2,9000000,1\n")
    arguments = ["--virtual", "--link", "delay 1ms", "--sends", str(sends), "--csv", str(path)]
    assert feelahead.main.command([*BENCH, *arguments]) == 0
    assert [int(row["received_ns"]) for row in rows(path)] == [1_000_000, 8_000_000, 10_000_000]


def test_a_comparison_prints_every_seed_and_a_verdict(capsys: pytest.CaptureFixture[str]) -> None:
    recording = DATA / "netem" / "normal.csv.gz"
    link = "delay 50ms 10ms distribution normal"
    arguments = ["--virtual", "--link", link, "--against", str(recording), "--seeds", "3"]
    assert feelahead.main.command([*BENCH, *arguments]) == 0
    said = capsys.readouterr().out
    for text in ("median", "recorded", "stalls of the host: 0", "at most 0.03 asked", "reordered share"):
        assert text in said


@pytest.mark.parametrize(
    ("arguments", "named", "valid"),
    [
        (["--link", "delay 5"], "'5'", "50ms"),
        (["--rate", "0"], "--rate 0.0", "1 to 100000"),
        (["--count", "1"], "--count 1", "2 to"),
        (["--bytes", "3"], "--bytes 3", "16 to"),
        (["--seed", "-1"], "--seed -1", "0 or more"),
        (["--seeds", "3"], "--seeds 3", "--virtual --against"),
        (["--spin", "-1"], "--spin -1.0", "microseconds"),
        (["--virtual", "--spin", "100"], "--spin", "where nothing waits"),
        (["--virtual", "--realtime"], "--realtime", "where nothing waits"),
        (["--sends", "x.csv"], "--sends x.csv", "--virtual"),
        (["--against", "nowhere.csv"], "nowhere.csv", "delay_ns"),
        (["--csv", "/nowhere/x.csv"], "/nowhere/x.csv", "its folder is not there"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], named: str, valid: str) -> None:
    with pytest.raises(ConfigurationError) as refusal:
        feelahead.main.command([*BENCH, *arguments])
    text = str(refusal.value)
    assert "\n" not in text
    assert named in text
    assert valid in text


@pytest.mark.processes
def test_real_messages_take_the_delay_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "sample.csv"
    arguments = ["--link", "delay 40ms duplicate 10%", "--rate", "200", "--count", "200", "--csv", str(path)]
    assert feelahead.main.command([*BENCH, *arguments]) == 0
    said = capsys.readouterr().out
    for text in ("link to_operator: asked delay 40ms duplicate 10%", "to_robot", "share of one core", "release error"):
        assert text in said
    written = rows(path)
    delays_ms = [1e-6 * (int(row["received_ns"]) - int(row["sent_ns"])) for row in written if row["received_ns"]]
    assert len(written) == 200
    # Never early; how late, and how many leave at once after a pause and are refused, is the machine's affair.
    assert min(delays_ms) >= 40.0
    assert math.isfinite(max(delays_ms))
