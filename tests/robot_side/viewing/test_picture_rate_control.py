"""Pictures on a slow link: their rate is reduced, then quality, then size; later all return slowly, in reverse."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from robot_side.viewing.picture_rate_control import PictureRateControl, Step, steps


def test_rate_gives_way_first_then_quality_then_size() -> None:
    down = steps(30.0, 75)

    assert down[0] == (30.0, 75, False)
    assert down[-1] == (5.0, 30, True)
    changed = [[name for name in Step._fields if getattr(a, name) != getattr(b, name)] for a, b in pairwise(down)]
    order = [name for (name,) in changed]
    assert order == sorted(order, key=["rate_hz", "quality", "halved"].index)


@given(st.floats(0.1, 120.0), st.integers(1, 100), st.lists(st.floats(1e3, 1e8), max_size=50), st.integers(0, 2))
def test_never_more_than_was_asked_for_and_back_by_one_step_a_second(
    rate_hz: float, quality: int, left_bit_s: list[float], views: int
) -> None:
    picture_rate_control, every = PictureRateControl(rate_hz, quality), steps(rate_hz, quality)
    at = 0
    for number, left in enumerate(left_bit_s):
        now = every.index(picture_rate_control.update(left, views, 0.5 * number))
        assert now >= at - 1
        at = now
    for number in range(2 * len(every) + 2):
        picture_rate_control.update(1e12, views, 100.0 + number)
    assert picture_rate_control.step == (rate_hz, quality, False)


def test_what_pictures_take_is_measured_whatever_step_they_were_made_in() -> None:
    picture_rate_control = PictureRateControl(30.0, 75)
    for _ in range(200):
        picture_rate_control.made(2_000, picture_rate_control.step)
    assert picture_rate_control.update(1e6, 2, 0.0) == (30.0, 75, False)
    low = Step(5.0, 30, halved=True)
    for _ in range(200):
        picture_rate_control.made(int(40_000 * low.bytes_share()), low)
    step = picture_rate_control.update(4e6, 2, 1.0)
    assert step.quality == 75
    assert 8.0 * 2 * 40_000 * step.rate_hz <= 4e6
