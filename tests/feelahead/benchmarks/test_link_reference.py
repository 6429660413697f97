"""The model in virtual time beside recordings of the kernel's netem, with the recordings' own send times."""

import functools
from pathlib import Path

import numpy as np
import pytest

from common.emulation.profile import LinkProfile
from common.errors import ConfigurationError
from feelahead.benchmarks.link.reference import compare, independent_delays, judge, measure_band, table
from feelahead.benchmarks.link.samples import LinkSample, distance, play, read_link_sample
from tests.helpers.repository import DATA

pytestmark = pytest.mark.long

RECORDINGS = DATA / "netem"
NORMAL = "delay 50ms 10ms distribution normal"
SIZE_BYTES = 142


@functools.cache
def recording(name: str) -> LinkSample:
    return read_link_sample(RECORDINGS / f"{name}.csv.gz", "--against")


def nothing() -> None:
    pass


@pytest.mark.parametrize(
    ("name", "mean_ms", "sd_ms", "late"),
    [
        ("normal", 50.03, 9.86, 0.826),
        ("pareto", 49.63, 7.93, 0.542),
        ("norm_rate", 63.2, 5.5, 0.0),
        ("base", 0.02, 0, 0),
    ],
)
def test_recordings_are_what_was_measured(name: str, mean_ms: float, sd_ms: float, late: float) -> None:
    sample = recording(name)
    assert 1e3 * sample.mean_s == pytest.approx(mean_ms, abs=0.05)
    assert 1e3 * sample.sd_s == pytest.approx(sd_ms, abs=0.05)
    assert sample.late_share == pytest.approx(late, abs=5e-4)


def test_lost_packets_of_a_recording_are_found() -> None:
    sample = recording("gemodel")
    assert sample.sent_s.size == 10_000
    assert sample.loss_share == pytest.approx(0.0447, abs=1e-4)
    assert sample.mean_burst == pytest.approx(4.2, abs=0.05)
    assert np.all(np.diff(sample.sent_s) >= 0.0)


@pytest.mark.parametrize(
    ("name", "spec", "stalls"),
    [
        ("normal", NORMAL, 0),
        ("uniform", "delay 50ms 10ms", 38),
        ("pareto", "delay 50ms 10ms distribution pareto", 1),
    ],
)
def test_independent_delays_are_netems(name: str, spec: str, stalls: int) -> None:
    profile = LinkProfile.parse(spec)
    reference, left_out = recording(name).without_stalls(profile)
    assert left_out == stalls
    assert independent_delays(profile)
    # All twenty seeds of the benchmark: fewer would leave the median to chance.
    results = compare(profile, reference, 20, SIZE_BYTES, nothing)
    goals = judge(profile, reference, results, None)
    assert [goal.claim.split(",")[0] for goal in goals] == [
        "median Kolmogorov-Smirnov D",
        "median error of the mean",
        "median error of the sd",
        "median error of the reordered share",
    ]
    assert [goal.limit for goal in goals] == [0.03, 0.3, 0.3, 0.02]
    assert {goal.verdict for goal in goals} == {"met"}, goals
    assert len(table(reference, left_out, results).rows) == 22


@pytest.mark.parametrize(
    ("name", "spec", "pairs"), [("norm_rate", f"{NORMAL} rate 10mbit", 40), ("gemodel", "loss gemodel 1% 25%", 40)]
)
def test_what_depends_on_its_past_is_within_the_models_own_band(name: str, spec: str, pairs: int) -> None:
    profile = LinkProfile.parse(spec)
    assert not independent_delays(profile)
    reference, _ = recording(name).without_stalls(profile)
    results = compare(profile, reference, 10, SIZE_BYTES, nothing)
    band = measure_band(profile, reference, pairs, SIZE_BYTES, nothing)
    goals = judge(profile, reference, results, band)
    assert len(goals) == (5 if name == "norm_rate" else 4)
    assert {goal.verdict for goal in goals} == {"met"}, goals


@pytest.mark.parametrize(
    "spec", ["delay 50ms 10ms", "delay 50.6ms 10ms distribution normal", "delay 50ms 11ms distribution normal"]
)
def test_another_link_is_told_apart(spec: str) -> None:
    profile = LinkProfile.parse(spec)
    results = compare(profile, recording("normal"), 5, SIZE_BYTES, nothing)
    assert "missed" in {goal.verdict for goal in judge(profile, recording("normal"), results, None)}


def test_the_virtual_link_delivers_when_due() -> None:
    sample, line = play(LinkProfile.parse("delay 50ms"), [0.0, 0.5, 0.75], SIZE_BYTES)
    assert sample.delay_s == pytest.approx(0.050)
    assert line.summary()["achieved"]["release_error_us"]["max"] == 0.0


def test_of_two_copies_the_first_counts() -> None:
    sample, line = play(LinkProfile.parse("delay 50ms 10ms duplicate 100%"), [0.1 * n for n in range(2000)], SIZE_BYTES)
    assert line.figures.delivered == 4000
    # The lesser of two uniform numbers: a third of the range from its bottom.
    assert sample.mean_s == pytest.approx(0.040 + 0.020 / 3.0, abs=0.5e-3)


def test_distances_of_distributions() -> None:
    def delays(*values: float) -> LinkSample:
        return LinkSample(np.arange(len(values), dtype=np.float64), np.array(values))

    assert distance(delays(1, 2, 3, 4), delays(1, 2, 3, 4)) == 0.0
    assert distance(delays(1, 2), delays(3, 4)) == 1.0
    assert distance(delays(1, 2, 3, 4), delays(1, 2, 3, 9, np.nan)) == pytest.approx(0.25)


def test_late_messages_are_those_overtaken() -> None:
    sample = LinkSample(np.array([0.0, 1.0, 2.0, 3.0]), np.array([2.5, 0.1, np.nan, 0.1]))
    # In order of arrival 1, 0, 3: one of three came after a later one.
    assert sample.late_share == pytest.approx(1 / 3)
    assert sample.loss_share == 0.25
    assert sample.mean_burst == 1.0


def test_a_recording_without_send_times_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "delays.csv"
    path.write_text("delay_ns\n1\n2\n")
    with pytest.raises(ConfigurationError, match=r"--sends: .* lacks send times"):
        read_link_sample(path, "--sends")
