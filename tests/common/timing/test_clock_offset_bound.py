"""The error of an estimated clock offset never exceeds the reported bound, for any delay, drift and jitter."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.timing.clock_offset import MAX_SKEW, ClockOffset
from tests.helpers.clock_exchanges import ahead, exchange

delay = st.floats(0.0, 0.5) | st.floats(0.0, 1e-4) | st.just(0.0)
drift = st.floats(-MAX_SKEW, MAX_SKEW) | st.sampled_from([-MAX_SKEW, MAX_SKEW, 0.0])
rounds = st.lists(
    st.tuples(delay, delay, delay, st.floats(0.0, 2.0) | st.just(0.004), drift, st.booleans()), max_size=60
)


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
            assert one_way_s is None or one_way_s >= -1e-8  # A clock far apart is rounded.
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
