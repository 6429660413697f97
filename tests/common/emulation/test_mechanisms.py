"""Duplicates, corruption, reordering, rate, outages and streams of an emulated link, compared with theory or netem."""

import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.emulation.clauses import LinkModel, Outage
from common.emulation.delay_line import DelayLine
from common.emulation.profile import LinkProfile
from tests.helpers.link_runs import PERIOD_S, Run


def test_duplicates_arrive_apart() -> None:
    run = Run("delay 50ms 10ms duplicate 10%", 20_000)
    copies = len(run.deliveries) - 20_000
    assert copies / 20_000 == pytest.approx(0.10, abs=0.01)
    assert run.line.figures.duplicated == copies
    assert not any(run.lost)
    assert run.line.summary()["achieved"]["duplicate_share"] == pytest.approx(copies / (20_000 + copies))


def test_corruption_turns_over_one_bit() -> None:
    line: DelayLine[bytes] = DelayLine(LinkProfile.parse("corrupt 20%"))
    whole = bytes(range(50))
    altered = 0
    places = set()
    for number in range(5000):
        line.push(float(number), whole)
        [received] = line.pop(float(number))
        difference = int.from_bytes(received, "big") ^ int.from_bytes(whole, "big")
        assert len(received) == len(whole)
        assert difference.bit_count() <= 1
        altered += difference != 0
        places.add(difference)
    assert altered / 5000 == pytest.approx(0.20, abs=0.02)
    assert line.figures.corrupted == altered
    assert len(places) > 300


def test_corruption_reaches_into_items_by_the_function_given() -> None:
    line: DelayLine[tuple[int, bytes]] = DelayLine(
        LinkProfile.parse("corrupt 100%"), corrupt=lambda item, flip: (item[0], flip(item[1]))
    )
    line.push(0.0, (7, b"\x00\x00"))
    [(number, payload)] = line.pop(0.0)
    assert number == 7
    assert sum(byte.bit_count() for byte in payload) == 1


def test_reordering_sends_a_share_at_once() -> None:
    run = Run("delay 10ms reorder 25%", 20_000)
    assert np.mean(run.delays_s == 0.0) == pytest.approx(0.25, abs=0.01)
    # A message sent at once overtakes the ten before it, so that nearly all delayed ones arrive late.
    assert run.line.summary()["achieved"]["late_share"] == pytest.approx(0.75 * (1.0 - 0.75**9), abs=0.02)


def test_a_gap_leaves_that_number_in_order() -> None:
    delays_s = Run("delay 10ms reorder 100% gap 5", 100).delays_s
    assert [number for number, delay_s in enumerate(delays_s) if delay_s == 0.0] == list(range(4, 100, 5))
    half = Run("delay 10ms reorder 50% gap 5", 20_000).delays_s
    gaps = np.diff(np.flatnonzero(half == 0.0))
    assert gaps.min() >= 5
    # After the gap, each trial succeeds with probability 1/2: one in six on average.
    assert gaps.mean() == pytest.approx(6.0, abs=0.1)


def test_a_rate_serves_one_message_after_the_other() -> None:
    # 100 bytes at 400 kbit/s take 2 ms, and one message comes every millisecond.
    run = Run("rate 400kbit", 50)
    assert [due_s for due_s, _ in run.deliveries] == pytest.approx([2e-3 * (number + 1) for number in range(50)])
    assert run.line.summary()["achieved"]["rate_bit_s"] == pytest.approx(400e3)
    of_bytes: DelayLine[bytes] = DelayLine(LinkProfile.parse("rate 1mbit"))
    of_bytes.push(0.0, b"x" * 125)
    assert of_bytes.next_due() == pytest.approx(1e-3)


def test_the_limit_drops_from_the_tail() -> None:
    run = Run("rate 400kbit limit 3", 300)
    # Half of the messages leave; the queue of three stays full.
    assert run.line.figures.dropped == pytest.approx(150, abs=4)
    assert [number for _, number in run.deliveries][:3] == [0, 1, 2]
    waits_s = [due_s - run.sent_s[number] for due_s, number in run.deliveries]
    assert max(waits_s) <= 3 * 2e-3 + 1e-9


def test_an_outage_holds_a_stream_back() -> None:
    run = Run("delay 5ms outage 200ms at 500ms", 1000, model="stream")
    assert not any(run.lost)
    assert run.delays_s[:500] == pytest.approx(0.005)
    assert run.delays_s[500:700] == pytest.approx(0.005 + 0.2 - PERIOD_S * np.arange(200))
    assert run.delays_s[700:] == pytest.approx(0.005)
    assert run.line.figures.held == 200


def test_outages_count_from_the_start_given() -> None:
    line: DelayLine[int] = DelayLine(LinkProfile.parse("outage 1s at 1s"), start_s=100.0)
    for now_s in (100.5, 101.5, 102.0):
        line.push(now_s, 0)
    assert line.figures.outage == 1
    assert Outage(1.0, 5.0, 10.0).end_s(26.0 - 1e-9) == pytest.approx(26.0)
    assert Outage(1.0, 5.0, 10.0).end_s(26.0) is None
    assert Outage(1.0, 5.0).end_s(4.9) is None


def test_a_stream_sends_what_was_lost_again() -> None:
    run = Run("delay 50ms loss 1% retransmit 62.5ms", 20_000, model="stream")
    assert not any(run.lost)
    assert [number for _, number in run.deliveries] == list(range(20_000))
    assert run.line.figures.retransmitted == pytest.approx(202, abs=45)
    # A lost message delays everything behind it until it is there.
    assert np.quantile(run.delays_s, 0.05) == pytest.approx(0.050)
    assert set(np.round(run.delays_s, 6)) <= set(np.round(np.arange(50, 176, 0.5) / 1e3, 6))


def test_a_stream_recovers_within_a_round_trip_and_a_quarter() -> None:
    profile = LinkProfile.parse("delay 50ms loss 1%", model="stream")
    assert profile.recovery_s() == pytest.approx(1.25 * 0.100)
    assert LinkProfile.parse("loss 1%", model="stream").recovery_s() == 1e-3
    assert LinkProfile.parse("delay 50ms retransmit 1s", model="stream").recovery_s() == 1.0


def test_a_stream_shows_no_duplicates_and_checks_for_corruption() -> None:
    line: DelayLine[bytes] = DelayLine(LinkProfile.parse("delay 9ms 9ms duplicate 50% corrupt 10%", 1, "stream"))
    received = []
    for number in range(2000):
        line.push(number * PERIOD_S, number.to_bytes(2, "big"))
        received += line.pop(number * PERIOD_S)
    received += line.pop(10.0)
    assert [int.from_bytes(item, "big") for item in received] == list(range(2000))
    assert line.figures.corrupted == pytest.approx(200, abs=45)


CLAUSES = (
    "",
    "delay 5ms",
    "delay 9ms 9ms distribution normal",
    "delay 3ms 9ms 30% reorder 20% gap 3",
    "loss 20% 10%",
    "loss gemodel 10% 30%",
    "duplicate 30%",
    "corrupt 20%",
    "rate 500kbit 10",
    "limit 4",
    "outage 10ms at 5ms every 30ms",
)


def profiles(model: LinkModel) -> Iterator[str]:
    for one, other in itertools.combinations(CLAUSES, 2):
        if one.split()[:1] != other.split()[:1]:
            yield f"{one} {other} retransmit 7ms" if model == "stream" else f"{one} {other}"


@given(
    st.lists(st.floats(0.0, 0.01), min_size=1, max_size=60),
    st.sampled_from(["datagram", "stream"]),
    st.data(),
    st.integers(0, 9),
    st.lists(st.booleans(), min_size=60, max_size=60),
)
def test_nothing_appears_or_vanishes_uncounted(
    gaps_s: list[float], model: LinkModel, data: st.DataObject, seed: int, pops: list[bool]
) -> None:
    spec = data.draw(st.sampled_from(list(profiles(model))))
    line: DelayLine[bytes] = DelayLine(LinkProfile.parse(spec, seed, model))
    now_s, popped = 100.0, []
    for number, (gap_s, pop) in enumerate(zip(gaps_s, pops, strict=False)):
        now_s += gap_s
        line.push(now_s, number.to_bytes(1, "big") * 20)
        if pop:
            due_s = line.next_due()
            if due_s is not None and due_s > now_s:
                assert line.pop(math.nextafter(min(due_s, now_s), -math.inf)) == []
            popped += line.pop(now_s)
            next_s = line.next_due()
            assert next_s is None or next_s > now_s
        figures = line.figures
        gone = figures.lost + figures.outage + figures.dropped
        assert figures.sent + figures.duplicated == len(popped) + gone + line.waiting
    while (due_s := line.next_due()) is not None:
        arrived = line.pop(due_s)
        assert arrived
        popped += arrived
    assert line.waiting == 0
    if model == "stream":
        first_bytes = [item[0] for item in popped]
        assert first_bytes == sorted(set(first_bytes))
        assert line.figures.lost == line.figures.outage == 0


@pytest.mark.parametrize("model", ["datagram", "stream"])
def test_the_same_seed_gives_the_same_deliveries(model: LinkModel) -> None:
    spec = "delay 20ms 9ms 20% distribution normal loss 5% 20% duplicate 5% reorder 5% rate 9mbit"
    first = Run(spec, 1500, 4, model).deliveries
    assert Run(spec, 1500, 4, model).deliveries == first
    assert Run(spec, 1500, 5, model).deliveries != first
