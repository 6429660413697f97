import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.timing.clock_offset import MAX_SKEW, ClockOffset
from tests.helpers.clock_exchanges import Draw, ahead, error_s, exchange, normal, queue, talk

repeatable = settings(derandomize=True, deadline=None)


def test_nothing_is_known_before_the_first_exchange() -> None:
    offset = ClockOffset(shared_clock=False)
    offset.arrived(100.0, 1.0)
    assert (offset.offset_s, offset.bound_s, offset.round_trip_s, offset.estimator) == (None, None, None, None)
    assert offset.one_way_from_peer_s(101.0, 2.0) is None
    assert not offset.settled


@repeatable
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


@repeatable
@given(st.floats(1e-6, 1.0), st.floats(1e-6, 1.0))
def test_an_asymmetric_floor_costs_half_of_itself_and_stays_within_the_bound(there_s: float, back_s: float) -> None:
    offset, clock = ClockOffset(shared_clock=False), ahead(100.0)
    received_s = exchange(offset, 0.0, there_s, 0.002, back_s, clock)
    assert offset.bound_s is not None
    assert error_s(offset, clock, received_s) == pytest.approx((there_s - back_s) / 2.0, abs=1e-9 + MAX_SKEW * 2.002)
    assert abs(error_s(offset, clock, received_s)) <= offset.bound_s


# The two estimators, after a minute of 250 exchanges a second


@pytest.mark.parametrize(
    ("there", "back", "asymmetry_s", "estimator"),
    [
        (queue(0.050, 0.010), queue(0.050, 0.010), 0.0, "mean"),
        (queue(0.050, 0.010), queue(0.050, 0.001), 0.0, "interval"),
        (queue(0.050, 0.002), queue(0.030, 0.002), 0.020, "mean"),
        (normal(0.050, 0.010), normal(0.050, 0.010), 0.0, "mean"),
    ],
)
@pytest.mark.parametrize("skew", [0.0, 20e-6])
def test_jitter_costs_half_a_millisecond(
    there: Draw, back: Draw, asymmetry_s: float, estimator: str, skew: float
) -> None:
    generator, clock = np.random.default_rng(8), ahead(1e5, skew)
    offset = ClockOffset(shared_clock=False, asymmetry_s=asymmetry_s)
    end_s = talk(offset, clock, there(generator, 15_000), back(generator, 15_000))
    assert offset.estimator == estimator
    assert offset.settled
    assert abs(error_s(offset, clock, end_s)) < 0.5e-3


def test_a_queue_in_one_direction_takes_no_mean() -> None:
    generator, clock = np.random.default_rng(13), ahead(0.0)
    offset = ClockOffset(shared_clock=False)
    queue_s = 0.060 * np.abs(np.sin(np.arange(5000) / 200.0))
    there_s, back_s = 0.050 + generator.exponential(0.005, (2, 5000))
    end_s = talk(offset, clock, there_s + queue_s, back_s)
    assert offset.estimator == "interval"
    assert abs(error_s(offset, clock, end_s)) < queue_s.mean() / 2.0 / 4.0


def test_a_handful_of_samples_is_no_mean() -> None:
    generator = np.random.default_rng(15)
    offset = ClockOffset(shared_clock=False)
    there_s, back_s = generator.normal(0.050, 0.010, (2, 450))
    talk(offset, ahead(0.0), there_s, back_s)
    assert offset.estimator == "interval"


def test_the_same_echo_many_times_and_in_any_order_is_one_sample() -> None:
    once, often = ClockOffset(shared_clock=False), ClockOffset(shared_clock=False)
    generator, clock = np.random.default_rng(17), ahead(3.0)
    for k, (there_s, back_s) in enumerate(generator.normal(0.050, 0.010, (1500, 2))):
        sent_s, slow = 0.01 * k, there_s > 0.055
        received_s = exchange(once, sent_s, there_s, 0.0, back_s, clock)
        exchange(often, sent_s, there_s, 0.0, back_s, clock)
        # What took long is echoed eight times, by turns with the stamp before it.
        for repeat in range(8 if slow and k else 0):
            later_s, before_s = 1e-4 * repeat, 0.01 * repeat % 0.02
            peer_sent_s = clock(sent_s + there_s + later_s)
            often.update(sent_s - before_s, peer_sent_s, later_s, received_s + later_s, arrived_last=before_s == 0.0)
            often.overtaken(sent_s, peer_sent_s, later_s, received_s + later_s)
    assert often._to_peer.count == pytest.approx(once._to_peer.count, abs=20)
    assert len(often._echoed_fairly_s) <= 1025


# The bound


delay = st.floats(0.0, 0.5) | st.floats(0.0, 1e-4) | st.just(0.0)
drift = st.floats(-MAX_SKEW, MAX_SKEW) | st.sampled_from([-MAX_SKEW, MAX_SKEW, 0.0])
rounds = st.lists(
    st.tuples(delay, delay, delay, st.floats(0.0, 2.0) | st.just(0.004), drift, st.booleans()), max_size=60
)


@repeatable
@given(rounds, st.floats(-1e6, 1e6), st.floats(-0.5, 0.5) | st.just(0.0))
def test_the_bound_is_never_violated_whatever_the_delays_and_the_drift(
    steps: list[tuple[float, float, float, float, float, bool]], apart_s: float, asymmetry_s: float
) -> None:
    offset = ClockOffset(shared_clock=False, asymmetry_s=asymmetry_s)
    now_s, peer_s = 5.0, 5.0 + apart_s
    for there_s, held_s, back_s, pause_s, skew, lost in steps:
        rate, start_s = 1.0 + skew, now_s
        peer_received_s = peer_s + rate * there_s
        peer_sent_s = peer_received_s + rate * held_s
        now_s += there_s + held_s + back_s
        peer_s = peer_sent_s + rate * back_s
        if not lost:
            offset.update(start_s, peer_sent_s, peer_sent_s - peer_received_s, now_s)
            one_way_s = offset.one_way_from_peer_s(peer_sent_s, now_s)
            assert one_way_s is not None
            assert one_way_s >= -1e-9 - 1e-14 * abs(apart_s)
        now_s, peer_s = now_s + pause_s, peer_s + rate * pause_s
        estimate_s, bound_s = offset.offset_at(now_s), offset.bound_at(now_s)
        if estimate_s is not None and bound_s is not None:
            assert abs(estimate_s - (peer_s - now_s)) <= bound_s
    assert offset.jumps == 0


def test_the_bound_is_half_the_least_round_trip_and_loosens_with_time() -> None:
    offset = ClockOffset(shared_clock=False)
    exchange(offset, 0.0, 0.040, 0.0, 0.040, ahead(9.0))
    received_s = exchange(offset, 0.1, 0.010, 0.0, 0.010, ahead(9.0))
    assert offset.bound_at(received_s) == pytest.approx(0.010, abs=MAX_SKEW * 0.02)
    assert offset.bound_at(received_s + 100.0) == pytest.approx(0.010 + MAX_SKEW * 100.0, abs=MAX_SKEW * 0.02)


# Clocks that are one, clocks that jump, and routes that change


def test_a_shared_clock_is_exact_and_needs_no_estimate() -> None:
    offset = ClockOffset(shared_clock=True)
    assert offset.settled
    assert offset.one_way_from_peer_s(1.0, 1.25) == 0.25
    talk(offset, ahead(0.0), np.full(500, 0.3), np.full(500, 0.1))
    assert (offset.offset_s, offset.bound_s, offset.estimator) == (0.0, 0.0, "shared clock")
    assert offset.round_trip_s == pytest.approx(0.4)


@pytest.mark.parametrize("jump_s", [-3600.0, -5.0, -0.150, 0.150, 5.0, 3600.0])
def test_a_clock_that_jumps_by_more_than_the_round_trip_is_followed_within_a_second(jump_s: float) -> None:
    generator, before, after = np.random.default_rng(23), ahead(70.0, 20e-6), ahead(70.0 + jump_s, 20e-6)
    offset = ClockOffset(shared_clock=False)
    queues_s = 0.050 + generator.exponential(0.005, (2, 2000))
    end_s = talk(offset, before, queues_s[0], queues_s[1])
    assert offset.jumps == 0
    end_s = talk(offset, after, queues_s[0][:250], queues_s[1][:250], start_s=end_s)
    assert offset.jumps == 1
    bound_s = offset.bound_at(end_s)
    assert bound_s is not None
    assert abs(error_s(offset, after, end_s)) <= min(bound_s, 0.5e-3)


@pytest.mark.parametrize("jump_s", [-0.070, 0.070])
def test_a_smaller_jump_is_followed_as_fast_as_clocks_may_drift(jump_s: float) -> None:
    generator, before, after = np.random.default_rng(24), ahead(70.0), ahead(70.0 + jump_s)
    offset = ClockOffset(shared_clock=False)
    queues_s = 0.050 + generator.exponential(0.005, (2, 2000))
    end_s = talk(offset, before, queues_s[0], queues_s[1])
    for seconds in range(0, 120, 8):
        end_s = talk(offset, after, queues_s[0], queues_s[1], start_s=end_s)
        assert abs(error_s(offset, after, end_s)) < max(0.5e-3, abs(jump_s) / 2.0 - MAX_SKEW * seconds / 2.0)
    assert offset.jumps == 0


def test_what_we_sent_before_our_own_clock_jumped_says_nothing_after_it() -> None:
    offset, slept_s = ClockOffset(shared_clock=False), 0.100

    def ours(true_s: float) -> float:
        """Stands still while we sleep."""
        return true_s if true_s < 5.0 else max(5.0, true_s - slept_s)

    messages = []
    for k in range(1500):
        sent_s = 0.004 * k + (0.0 if k < 1250 else slept_s)
        # The last ones before the sleep take long to come back.
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
    assert offset.offset_s == pytest.approx(slept_s, abs=MAX_SKEW * 0.04)


@pytest.mark.parametrize(("there_s", "back_s"), [(0.040, 0.040), (0.140, 0.080)])
def test_a_route_that_gets_shorter_or_longer_is_no_jump(there_s: float, back_s: float) -> None:
    generator, clock = np.random.default_rng(24), ahead(70.0)
    offset = ClockOffset(shared_clock=False)
    queues_s = generator.exponential(0.005, (2, 2000))
    end_s = talk(offset, clock, 0.080 + queues_s[0], 0.080 + queues_s[1])
    end_s = talk(offset, clock, there_s + queues_s[0], back_s + queues_s[1], start_s=end_s)
    assert offset.jumps == 0
    bound_s = offset.bound_at(end_s)
    assert bound_s is not None
    assert abs(error_s(offset, clock, end_s)) <= bound_s
    if there_s == back_s:
        assert abs(error_s(offset, clock, end_s)) < 0.5e-3


# Stamps that are wrong


@pytest.mark.parametrize(
    ("sent_s", "peer_s", "held_s", "received_s"),
    [
        (1.0, 5.0, -0.001, 1.1),
        (1.0, 5.0, 0.2, 1.1),
        (1.0, 5.0, 0.0, 0.9),
        (1.0, math.nan, 0.0, 1.1),
        (1.0, 1e300, 0.0, 1.1),
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
    assert abs(error_s(offset, clock, end_s)) < 0.2e-3
    assert offset.jumps == 0


def test_a_holding_time_by_a_fast_clock_is_no_contradiction() -> None:
    offset = ClockOffset(shared_clock=False)
    exchange(offset, 0.0, 1e-6, 10.0, 1e-6, ahead(0.0, 100e-6))
    assert offset.rejected == 0
    assert offset.round_trip_s == 0.0


@pytest.mark.parametrize(("name", "value"), [("asymmetry_s", math.nan), ("asymmetry_s", math.inf), ("max_skew", 0.0)])
def test_refuses_settings_that_are_none(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} = "):
        ClockOffset(shared_clock=False, **{name: value})
