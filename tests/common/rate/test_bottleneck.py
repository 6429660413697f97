"""All of rate control together, before a slow link in virtual time: rate controller, budget, pieces, picture rate."""

from itertools import pairwise

import pytest

from common.emulation.delay_line import DelayLine
from common.emulation.named_links import NAMED_LINKS
from common.emulation.spec import LinkSpec
from tests.common.rate.bottleneck import Bottleneck, run

DELAY_S = 0.025


def back(delay_s: float = DELAY_S) -> Bottleneck:
    return Bottleneck(lambda _: 1e8, delay_s=delay_s)


@pytest.mark.parametrize("queue_s", [0.05, 0.2, 1.0])
@pytest.mark.parametrize("mbit_s", [0.5, 1.0, 2.0, 5.0, 10.0])
def test_no_queue_of_our_own_making_from_half_a_megabit_on(mbit_s: float, queue_s: float) -> None:
    ran = run(Bottleneck(lambda _: 1e6 * mbit_s, queue_s), back(), 12.0)

    assert ran.delay_s(0.95) - DELAY_S <= 0.020
    # Pictures still come, and more of them where there is room.
    assert len(ran.pictures) >= 10.0 * {0.5: 5, 1.0: 7, 2.0: 7, 5.0: 20, 10.0: 40}[mbit_s]


@pytest.mark.parametrize("queue_s", [0.05, 0.2, 1.0])
def test_at_a_quarter_of_a_megabit_haptics_flow(queue_s: float) -> None:
    ran = run(Bottleneck(lambda _: 0.25e6, queue_s), back(), 12.0)

    assert ran.delay_s(0.95) - DELAY_S <= 0.030
    sent_s = [at_s for at_s, _ in ran.delays_s]
    assert max(later_s - sooner_s for sooner_s, later_s in pairwise(sent_s)) <= 0.0215


def test_a_rate_that_falls_to_a_tenth_is_followed_within_a_second_and_found_again() -> None:
    delay_s = 0.010
    out = Bottleneck(lambda now_s: 0.5e6 if 10.0 <= now_s < 20.0 else 5e6, delay_s=delay_s)

    ran = run(out, back(delay_s), 40.0)

    assert ran.late_until_s(0.1 + delay_s, since_s=10.0) <= 11.0
    assert ran.delay_s(0.95, 12.0, 20.0) - delay_s <= 0.020
    assert ran.rates_bit_s[19_000] <= 0.6e6
    assert max(ran.rates_bit_s[20_000:35_000]) >= 4.5e6
    assert ran.delay_s(0.95, 20.0) - delay_s <= 0.020


@pytest.mark.parametrize("name", NAMED_LINKS)
def test_jitter_is_no_queue(name: str) -> None:
    spec = LinkSpec.parse(name)
    lines = [DelayLine[object](spec.profile(way, "haptics")) for way in ("to_operator", "to_robot")]

    ran = run(lines[0], lines[1], 20.0)

    assert min(ran.rates_bit_s[5_000:]) >= 4e6
    assert len([at_s for at_s, _ in ran.pictures if at_s >= 5.0]) >= 15.0 * 30.0


@pytest.mark.parametrize("drift", [600e-6, -600e-6])
def test_clocks_that_drift_apart_are_no_queue(drift: float) -> None:
    ran = run(Bottleneck(lambda _: 2e6), back(), 40.0, drift=drift)

    assert ran.delay_s(0.95, 20.0) - DELAY_S <= 0.020
    assert ran.rates_bit_s[-1] >= 1.3e6


def test_a_queue_that_others_make_does_not_stop_pictures() -> None:
    ran = run(Bottleneck(lambda _: 2e6), back(), 30.0, others_s=0.1)

    assert ran.delay_s(0.5, 10.0) - DELAY_S >= 0.1
    assert len([at_s for at_s, _ in ran.pictures if at_s >= 10.0]) >= 20.0 * 5.0


def test_a_link_that_carries_everything_gets_whole_pictures_at_once() -> None:
    ran = run(Bottleneck(lambda _: 1e9, delay_s=0.0002), back(0.0002), 8.0)

    late = [age_s for at_s, age_s in ran.pictures if at_s >= 4.0]
    assert sorted(late)[len(late) // 2] <= 0.002
    assert ran.picture_rate_control.step == (30.0, 75, False)
