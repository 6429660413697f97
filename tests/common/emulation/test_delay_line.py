import math
import re
import statistics
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.emulation.clauses import LinkModel
from common.emulation.delay_line import DelayLine, link_summary
from common.emulation.named_links import NAMED_LINKS
from common.emulation.profile import LinkProfile
from common.emulation.spec import Direction, LinkSpec, Stream, unused_clauses
from tests.helpers.refusal import refusal

EVERY_STREAM: list[tuple[Direction, Stream]] = [
    (direction, stream) for direction in ("to_robot", "to_operator") for stream in ("haptics", "telemetry", "video")
]


def given_delays_s(profile: LinkProfile, count: int) -> list[float]:
    """Return the delays, in seconds, that an emulated link of `profile` gives to messages sent 1 s apart."""
    line: DelayLine[int] = DelayLine(profile)
    delays_s = []
    for number in range(count):
        line.push(float(number), number)
        due_s = line.next_due()
        assert due_s is not None
        delays_s.append(due_s - number)
        assert line.pop(due_s) == [number]
    return delays_s


@given(
    st.lists(st.floats(0.0, 0.02), min_size=1, max_size=60),
    st.sampled_from(["", "delay 5ms", "delay 50ms 30ms", "delay 50ms 30ms distribution normal"]),
    st.sampled_from(["datagram", "stream"]),
    st.integers(0, 9),
)
def test_delivers_each_once_in_order_of_due_time(gaps_s: list[float], spec: str, model: LinkModel, seed: int) -> None:
    delays_s = given_delays_s(LinkProfile.parse(spec, seed), len(gaps_s))
    line: DelayLine[int] = DelayLine(LinkProfile.parse(spec, seed, model))
    pushed_s = [100.0 + sum(gaps_s[: number + 1]) for number in range(len(gaps_s))]
    for number, now_s in enumerate(pushed_s):
        line.push(now_s, number)
    received: list[tuple[float, int]] = []
    while (due_s := line.next_due()) is not None:
        arrived = line.pop(due_s)
        assert arrived
        received += [(due_s, number) for number in arrived]
    due_of_s = [now_s + delay_s for now_s, delay_s in zip(pushed_s, delays_s, strict=True)]
    if model == "stream":
        due_of_s = [max(due_of_s[: number + 1]) for number in range(len(due_of_s))]
    assert received == sorted(received)
    assert sorted(number for _, number in received) == list(range(len(gaps_s)))
    for due_s, number in received:
        assert due_s == pytest.approx(due_of_s[number], abs=1e-9)


def test_reports_what_was_asked_and_achieved() -> None:
    line: DelayLine[int] = DelayLine(LinkProfile.parse("delay 50ms 10ms loss 10%", seed=3))
    empty = line.summary()
    assert empty["asked"] == "delay 50ms 10ms loss 10%"
    assert empty["achieved"]["delay_ms"]["mean"] is None
    assert empty["achieved"]["loss_share"] is None
    delays_s = []
    for number in range(900):
        line.push(float(number), number, 125)
        if (due_s := line.next_due()) is not None:
            assert line.pop(due_s) == [number]
            delays_s.append(due_s - number)
    achieved = line.summary()["achieved"]
    assert (achieved["sent"], achieved["delivered"], achieved["waiting"]) == (900, len(delays_s), 0)
    assert achieved["loss_share"] == pytest.approx(1.0 - len(delays_s) / 900)
    assert achieved["delay_ms"]["mean"] == pytest.approx(1e3 * statistics.fmean(delays_s), rel=1e-9)
    assert achieved["delay_ms"]["sd"] == pytest.approx(1e3 * statistics.stdev(delays_s), rel=1e-9)
    assert achieved["delay_ms"]["p50"] == pytest.approx(1e3 * statistics.median(delays_s), rel=1e-9)
    assert achieved["rate_bit_s"] == pytest.approx(1000.0 * len(delays_s) / 900, rel=0.01)
    assert achieved["late_share"] == achieved["duplicate_share"] == 0.0
    assert achieved["release_error_us"]["max"] == 0.0
    assert list(link_summary("to_robot", {"haptics": line, "video": line})) == ["to_robot", "to_robot.video"]


@pytest.mark.parametrize(
    ("spec", "call", "said"),
    [
        *(("", lambda line, now_s=now_s: line.push(now_s, 1), "now_s = ") for now_s in (math.nan, math.inf)),
        *(("", lambda line, now_s=now_s: line.pop(now_s), "now_s = ") for now_s in (math.nan, math.inf)),
        ("corrupt 1%", lambda line: line.push(0.0, 1), "item is not bytes"),
        ("rate 1mbit", lambda line: line.push(0.0, 1), "size_bytes is missing"),
        ("rate 1mbit", lambda line: line.push(0.0, 1, -1), "size_bytes = -1"),
    ],
)
def test_refuses_what_cannot_be_sent(spec: str, call: Callable[[DelayLine[int]], object], said: str) -> None:
    line: DelayLine[int] = DelayLine(LinkProfile.parse(spec))
    with pytest.raises(ValueError, match=said):
        call(line)
    assert line.figures.sent == 0
    assert line.next_due() is None


NAMES = ("", "to_robot", "to_operator", "haptics", "video", "to_operator.haptics", "to_robot.video")


@given(st.lists(st.sampled_from(NAMES), unique=True))
def test_the_closest_clause_wins(names: list[str]) -> None:
    spec = LinkSpec.parse(" ; ".join(f"{name}: delay {1 + NAMES.index(name)}ms".removeprefix(": ") for name in names))
    for direction, stream in EVERY_STREAM:
        closest = [name for name in (f"{direction}.{stream}", stream, direction, "") if name in names]
        expected_s = 1e-3 * (1 + NAMES.index(closest[0])) if closest else 0.0
        assert spec.profile(direction, stream).delay_s == pytest.approx(expected_s)


def test_clauses_that_apply_to_nothing_are_told() -> None:
    sent: list[tuple[Direction, Stream]] = [("to_operator", "haptics"), ("to_operator", "telemetry")]
    spec = LinkSpec.parse("to_robot: delay 20ms; to_operator: delay 50ms; video: rate 2mbit")
    # The other side may be given the same link: its direction is no mistake.
    assert spec.unused(sent) == ["video"]
    assert unused_clauses(spec, sent) == ["--link: 'video' changes nothing: this side sends no such messages"]
    overridden = LinkSpec.parse("delay 1ms; haptics: delay 2ms; telemetry: delay 3ms")
    assert unused_clauses(overridden, sent) == [
        "--link: the profile without a name changes nothing: each stream that this side sends has its own"
    ]
    assert LinkSpec.parse("delay 1ms").unused(sent) == []
    assert LinkSpec.parse("to_robot: delay 20ms").unused(sent) == ["to_robot"]
    assert not [name for name in NAMED_LINKS if LinkSpec.parse(name).unused(sent)]


def test_a_round_trip_counts_both_directions() -> None:
    spec = LinkSpec.parse("to_robot: delay 20ms; to_operator: delay 50ms", model="stream")
    assert spec.profile("to_robot").round_trip_s == pytest.approx(0.070)
    assert spec.profile("to_operator").recovery_s() == pytest.approx(1.25 * 0.070)


def test_no_two_streams_are_correlated() -> None:
    spec = LinkSpec.parse("delay 50ms 10ms distribution normal", seed=9)
    delays_s = [given_delays_s(spec.profile(*key), 2000) for key in EVERY_STREAM]
    correlations = np.corrcoef(np.array(delays_s)) - np.eye(len(EVERY_STREAM))
    assert np.max(np.abs(correlations)) < 4.0 / math.sqrt(2000)


@pytest.mark.parametrize(
    ("spec", "named"),
    [
        ("to_mars: delay 20ms", "'to_mars'"),
        (": delay 20ms", "''"),
        ("Video: delay 20ms", "'Video'"),
        ("video.to_robot: delay 20ms", "'video.to_robot'"),
        ("to_robot.haptics: delay 1ms; to_robot.haptics: delay 1ms", "'to_robot.haptics'"),
        ("video: delay 1ms; video: delay 2ms", "'video'"),
        ("delay 1ms; delay 2ms", "a profile without a name"),
    ],
)
def test_refuses_bad_names_and_lists_the_valid_ones(spec: str, named: str) -> None:
    text = refusal(LinkSpec.parse, spec)
    assert repr(spec) in text
    assert named in text
    assert re.search(
        "valid: .*to_robot, to_operator, haptics, telemetry, video, scene, or both as to_robot.haptics", text
    )


def test_an_outage_that_ends_within_another_is_waited_out_to_the_end() -> None:
    spec = "outage 2s at 0s every 3s outage 1500ms at 1900ms"
    line: DelayLine[bytes] = DelayLine(LinkProfile.parse(spec, model="stream"))
    line.push(0.0, b"x")
    # 0 to 2, 1.9 to 3.4, 3 to 5
    assert line.next_due() == pytest.approx(5.0)
