import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.timing.clock_offset import MAX_SKEW, ClockOffset
from tests.helpers.clock_exchanges import ahead, error_s, exchange, talk


@given(st.floats(-1e5, 1e5), st.floats(1e-6, 1.0), st.floats(0.0, 1.0))
def test_a_symmetric_link_gives_the_exact_offset(apart_s: float, way_s: float, held_s: float) -> None:
    offset = ClockOffset(shared_clock=False)
    received_s = exchange(offset, 7.0, way_s, held_s, way_s, ahead(apart_s))
    loosened_s = MAX_SKEW * (received_s - 7.0)
    assert offset.offset_s == pytest.approx(apart_s, abs=1e-9 + loosened_s)
    assert offset.round_trip_s == pytest.approx(2.0 * way_s, abs=1e-9)
    assert offset.bound_s == pytest.approx(way_s, abs=1e-9 + loosened_s)
    sent_s = received_s + apart_s
    assert offset.one_way_from_peer_s(sent_s, received_s + way_s) == pytest.approx(way_s, abs=1e-9 + 2 * loosened_s)


def test_an_asymmetry_that_is_known_costs_nothing() -> None:
    generator, clock = np.random.default_rng(5), ahead(-3.0, 20e-6)
    offset = ClockOffset(shared_clock=False, asymmetry_s=0.020)
    end_s = talk(offset, clock, 0.050 + generator.exponential(0.002, 1000), 0.030 + generator.exponential(0.002, 1000))
    assert abs(error_s(offset, clock, end_s)) < 0.1e-3


@pytest.mark.parametrize("jump_s", [-3600.0, -5.0, -0.150, 0.150, 5.0, 3600.0])
def test_a_clock_that_jumps_is_followed_within_a_second(jump_s: float) -> None:
    generator, before, after = np.random.default_rng(23), ahead(70.0, 20e-6), ahead(70.0 + jump_s, 20e-6)
    offset = ClockOffset(shared_clock=False)
    queues_s = 0.050 + generator.exponential(0.005, (2, 2000))
    end_s = talk(offset, before, queues_s[0], queues_s[1])
    assert offset.jumps == 0
    end_s = talk(offset, after, queues_s[0][:250], queues_s[1][:250], start_s=end_s)
    assert offset.jumps == 1
    assert abs(error_s(offset, after, end_s)) < 0.5e-3
    bound_s = offset.bound_at(end_s)
    assert bound_s is not None
    assert abs(error_s(offset, after, end_s)) <= bound_s


def test_what_we_sent_before_our_own_clock_jumped_says_nothing_after_it() -> None:
    offset, slept_s = ClockOffset(shared_clock=False), 0.100

    def ours(true_s: float) -> float:
        """Return what our clock shows at `true_s`; it stops while the machine sleeps."""
        return true_s if true_s < 5.0 else max(5.0, true_s - slept_s)

    messages = []
    for k in range(1500):
        sent_s = 0.004 * k + (0.0 if k < 1250 else slept_s)
        # The last ones before the sleep take long to return.
        back_s = 0.300 if 4.95 < sent_s < 5.0 else 0.020
        messages.append((sent_s + 0.020 + back_s, sent_s))
    for received_s, sent_s in sorted(messages):
        offset.update(ours(sent_s), sent_s + 0.020, 0.0, ours(received_s))
        if received_s > 5.25:
            bound_s, estimate_s = offset.bound_at(ours(received_s)), offset.offset_at(ours(received_s))
            assert estimate_s is not None
            assert bound_s is not None
            assert abs(estimate_s - slept_s) <= bound_s
    assert offset.jumps == 1
    assert offset.offset_s == pytest.approx(slept_s, abs=20e-6)


def delays_of(kind: str, generator: np.random.Generator, count: int) -> np.ndarray:
    """Draw the delays, in seconds, of `count` messages sent 4 ms apart over a link of the type `kind`."""
    exponential_s = generator.exponential(0.001, count)
    if kind == "wireless":
        return 0.002 + exponential_s + (generator.random(count) < 0.02) * generator.exponential(0.030, count)
    if kind == "local":
        return 50e-6 + exponential_s / 50.0
    if kind == "queue":  # Lindley's recursion: waiting behind all earlier messages
        waits_s = np.zeros(count)
        for k, served_s in enumerate(generator.exponential(0.0032, count - 1)):
            waits_s[k + 1] = max(0.0, waits_s[k] + served_s - 0.004)
        return 0.020 + waits_s
    if kind == "bursts":
        busy = np.repeat(generator.random(-(-count // 400)) < 0.4, 400)[:count]
        return 0.020 + exponential_s + 0.060 * busy
    wave_s = 0.010 * np.cumsum(generator.normal(0.0, 0.1, count))
    return 0.050 + np.abs(wave_s)  # wandering


@pytest.mark.parametrize("in_order", [False, True])
@pytest.mark.parametrize("kind", ["wireless", "local", "queue", "bursts", "wandering"])
def test_no_link_looks_like_a_jump_or_breaks_the_bound(kind: str, in_order: bool) -> None:
    generator, clock = np.random.default_rng(22), ahead(-7.0, 60e-6)
    offset = ClockOffset(shared_clock=False)
    sent_s = 0.004 * np.arange(2500)
    arrived_s = sent_s + delays_of(kind, generator, 2500)
    if in_order:
        arrived_s = np.maximum.accumulate(arrived_s)
    received_s = arrived_s + delays_of(kind, generator, 2500)
    if in_order:
        received_s = np.maximum.accumulate(received_s)
    for k in np.argsort(received_s, kind="stable"):
        now_s = float(received_s[k])
        offset.update(float(sent_s[k]), clock(float(arrived_s[k])), 0.0, now_s)
        bound_s = offset.bound_at(now_s)
        assert bound_s is not None
        assert abs(error_s(offset, clock, now_s)) <= bound_s
    assert (offset.jumps, offset.rejected) == (0, 0)
    if kind != "wandering":  # Wandering delays have no constant minimum.
        assert abs(error_s(offset, clock, now_s)) < 1.1e-3


def test_a_jump_within_the_round_trip_is_forgotten_after_twenty_seconds() -> None:
    before, after = ahead(70.0), ahead(70.07)
    offset = ClockOffset(shared_clock=False)
    end_s = talk(offset, before, np.full(2000, 0.05), np.full(2000, 0.05))
    end_s = talk(offset, after, np.full(5500, 0.05), np.full(5500, 0.05), start_s=end_s)
    assert abs(error_s(offset, after, end_s)) < 1e-3


@pytest.mark.parametrize(("before_s", "there_s", "back_s"), [(0.080, 0.040, 0.040), (0.040, 0.140, 0.080)])
def test_a_route_that_gets_shorter_or_longer_is_no_jump(before_s: float, there_s: float, back_s: float) -> None:
    generator, clock = np.random.default_rng(24), ahead(70.0)
    offset = ClockOffset(shared_clock=False)
    queues_s = generator.exponential(0.005, (2, 2000))
    end_s = talk(offset, clock, before_s + queues_s[0], before_s + queues_s[1])
    end_s = talk(offset, clock, there_s + queues_s[0], back_s + queues_s[1], start_s=end_s)
    assert offset.jumps == 0
    assert abs(error_s(offset, clock, end_s)) < 0.5e-3


@pytest.mark.parametrize(
    ("sent_s", "peer_s", "held_s", "received_s"),
    [
        (1.0, 5.0, -0.001, 1.1),
        (1.0, 5.0, 0.2, 1.1),
        (1.0, 5.0, 0.0, 0.9),
        (1.0, math.nan, 0.0, 1.1),
        (1.0, 5.0, math.nan, 1.1),
        (-math.inf, 5.0, 0.0, 1.1),
    ],
)
def test_contradictory_stamps_are_counted_and_change_nothing(
    sent_s: float, peer_s: float, held_s: float, received_s: float
) -> None:
    offset = ClockOffset(shared_clock=False)
    assert not offset.update(sent_s, peer_s, held_s, received_s)
    assert offset.rejected == 1
    assert (offset.offset_s, offset.bound_s, offset.round_trip_s) == (None, None, None)


@pytest.mark.parametrize(("there_s", "back_s"), [(-0.5, 0.6), (0.6, -0.5)])
def test_a_message_from_the_future_is_counted_and_leaves_the_estimate_in_doubt_until_the_next(
    there_s: float, back_s: float
) -> None:
    offset, clock = ClockOffset(shared_clock=False), ahead(4.0)
    end_s = talk(offset, clock, np.full(500, 0.02), np.full(500, 0.02))
    exchange(offset, end_s, there_s, 0.0, back_s, clock)
    assert offset.rejected == 1
    assert offset.offset_s is None
    assert offset.one_way_from_peer_s(clock(end_s), end_s + 0.02) is None
    end_s = exchange(offset, end_s + 0.2, 0.02, 0.0, 0.02, clock)
    assert abs(error_s(offset, clock, end_s)) < 20e-6
    assert offset.jumps == 0


def test_a_holding_time_by_a_fast_clock_is_no_contradiction() -> None:
    offset = ClockOffset(shared_clock=False)
    exchange(offset, 0.0, 1e-6, 10.0, 1e-6, ahead(0.0, 100e-6))
    assert offset.rejected == 0
    assert offset.round_trip_s == 0.0


@pytest.mark.parametrize("asymmetry_s", [math.nan, math.inf])
def test_refuses_an_asymmetry_that_is_none(asymmetry_s: float) -> None:
    with pytest.raises(ValueError, match="asymmetry_s = "):
        ClockOffset(shared_clock=False, asymmetry_s=asymmetry_s)
