from typing import Final

from operator_side.viewing.pages.pace import PagePace

STEP_S: Final = 0.25


def after(pace: PagePace, late_s: float | None, for_s: float, now_s: float, skips: float = 0.0) -> float:
    for _ in range(round(for_s / STEP_S)):
        now_s += STEP_S
        pace.update(None if late_s is None else (late_s, skips), now_s)
    return now_s


def test_a_late_page_gets_fewer_pictures_first_and_only_then_a_slower_scene() -> None:
    """The lateness decides, not the processors; what gives way last comes back first."""
    pace, now_s, seen = PagePace(), 0.0, []
    for _ in range(40):
        now_s = after(pace, 0.3, STEP_S, now_s)
        seen.append(pace.now)
    rates = [one.picture_hz or 60.0 for one in seen]
    assert rates == sorted(rates, reverse=True)
    assert seen[-1] == (5.0, True, 5.0)
    assert all(one.picture_hz == 5.0 for one in seen if one.scene_hz is not None)
    assert (pace.because, pace.seldom) == ("the page was late by 300 ms", True)
    after(pace, 0.02, 600.0, now_s)
    assert (pace.now, pace.because, pace.seldom) == ((None, False, None), "", False)


def test_an_early_page_soon_gets_all_and_nobody_nothing_new() -> None:
    pace = PagePace()
    begun = pace.now
    now_s = after(pace, None, 60.0, 0.0)
    assert pace.now == begun
    after(pace, 0.02, 3.0, now_s)
    assert pace.now == (None, False, None)
    assert pace.because == ""


def test_a_page_that_skips_pictures_gets_fewer_and_no_slower_scene() -> None:
    pace = PagePace()
    after(pace, 0.02, 20.0, 0.0, skips=0.4)
    assert (pace.now, pace.because) == ((10.0, True, None), "the page skipped 40 % of them")


def test_a_pace_that_made_the_page_late_is_tried_ever_less_often() -> None:
    """A page that keeps up with the first pace and no more: in the third minute it changes at most twice a minute."""
    pace, now_s, changes = PagePace(), 0.0, []
    keeps = pace.now
    for _ in range(720):
        before, now_s = pace.now, now_s + STEP_S
        pace.update((0.3 if pace.now.picture_hz is None or pace.now.halved < keeps.halved else 0.03, 0.0), now_s)
        if pace.now != before:
            changes.append(now_s)
    assert 0 < sum(at_s > 120.0 for at_s in changes) <= 4
