"""One direction of the wide area behaves as its settings say; these tests use neither a clock nor a network."""

import pytest

from tests.two_hosts.wide_area.wire_direction import DirectionSettings, Wire

_PACKET_BYTES = 1250
_RATE_BIT_S = 1e6
"""Rate in bit/s at which a packet of these tests takes 10 ms"""


def arrivals(words: DirectionSettings, sent_s: list[float]) -> list[float | None]:
    way = Wire(words, 0, "to_operator", 0.0)
    return [way.take(_PACKET_BYTES, one_s) for one_s in sent_s]


def test_packets_queue_before_the_rate_and_those_that_would_wait_too_long_are_dropped() -> None:
    came = arrivals(DirectionSettings(0.1, rate_bit_s=_RATE_BIT_S, queue_s=0.025), [0.0] * 5)
    assert came == [pytest.approx(0.11), pytest.approx(0.12), pytest.approx(0.13), None, None]


def test_losses_are_as_many_as_asked_the_same_for_a_seed_and_bursts_take_all() -> None:
    sent_s = [0.01 * number for number in range(20_000)]
    came = arrivals(DirectionSettings(loss=0.01), sent_s)
    assert came == arrivals(DirectionSettings(loss=0.01), sent_s)
    assert came.count(None) == pytest.approx(200, abs=60)
    bursts = arrivals(DirectionSettings(burst_s=0.05), [0.01 * number + 0.005 for number in range(1000)])
    assert [number for number, one_s in enumerate(bursts) if one_s is None] == [*range(495, 500), *range(995, 1000)]
