"""The soak's own judgement; the soak itself is `feelahead try soak`."""

import re
import subprocess
import sys

import pytest

from feelahead.experiments.soak.command import try_soak
from feelahead.experiments.soak.sampling import Sample, flat, sample


def series(*resident_mb: float, descriptors: int = 10) -> list[Sample]:
    return [Sample(float(k), round(1024 * one), descriptors) for k, one in enumerate(resident_mb)]


def test_what_fills_at_the_start_and_then_stays_is_flat() -> None:
    assert flat(series(100, *[180] * 20))
    assert flat(series(*[100] * 20, 109))


def test_what_keeps_growing_is_not() -> None:
    assert not flat(series(*range(100, 121)))
    assert not flat([*series(*[100] * 20), Sample(20.0, 102_400, 11)])
    assert flat(series(*range(100, 121)), sides=2)


def test_a_process_is_looked_at() -> None:
    one = sample("self", 2.0)
    assert one.minutes == 2.0
    assert one.resident_kb > 10_000
    assert one.descriptors >= 3


def test_a_short_one_in_virtual_time(capsys: pytest.CaptureFixture[str]) -> None:
    assert try_soak(["--minutes", "0.02", "--virtual"]) == 0
    said = capsys.readouterr().out
    assert "flat" in said.splitlines()[-1]
    sent = re.search(r"'motion_sent': (\d+)", said)
    assert sent is not None
    # At 250 Hz, but for the first round trip.
    assert 250 < int(sent[1]) <= 300


@pytest.mark.processes
@pytest.mark.long
def test_a_short_one_with_observers(capsys: pytest.CaptureFixture[str]) -> None:
    assert try_soak(["--minutes", "0.1", "--observers", "8"]) == 0
    said = capsys.readouterr().out
    assert "with 8 observers" in said
    for name in ("robot side", "operator side", "observer 2", "this process"):
        assert name in said
    assert said.splitlines()[-1] == "flat"


@pytest.mark.processes
@pytest.mark.parametrize(
    "arguments",
    [
        ["--minutes", "0"],
        ["--minutes", "nan"],
        ["--link", "delay fast"],
        ["--seed", "-1"],
        ["--observers", "9"],
        ["--observers", "1", "--virtual"],
    ],
)
def test_bad_input_is_one_line(arguments: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "feelahead", "try", "soak", *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "valid" in done.stderr
