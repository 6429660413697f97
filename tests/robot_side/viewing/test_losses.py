"""How long a view stands still where messages are lost, with steps alone and with what `Losses` chooses."""

import numpy as np
import pytest

from robot_side.viewing.losses import Losses

PICTURE_S, ROUND_TRIP_S, WHOLE_S, REPORT_S = 1.0 / 15.0, 0.08, 0.5, 0.25
"""Intervals of pictures, the round trip, least interval of whole pictures among steps, and of reports of lost ones"""
STANDS_S = 0.5


def standing_share(loss: float, *, chooses: bool, for_s: float = 300.0) -> float:
    """Return the share of the time, after the first 5 s, in pauses of more than STANDS_S between pictures shown."""
    generator, losses = np.random.default_rng(1), Losses()
    shown_s, reports = [5.0], list[tuple[float, int]]()
    newest = lacking = reported = whole_number = number = 0
    whole_s = told_s = -1.0
    for now_s in np.arange(0.0, for_s, PICTURE_S).tolist():
        while reports and reports[0][0] <= now_s:
            reported = reports.pop(0)[1]
        alone = chooses and losses.many(now_s)
        number += not alone
        if not alone and reported > whole_number:
            losses.note("overview", whole_number, now_s)
        whole = not alone and (number == 1 or (reported > whole_number and now_s - whole_s >= WHOLE_S))
        if whole:
            whole_number, whole_s = number, now_s
        if generator.random() < loss:
            continue
        if alone or whole or newest == number - 1:
            newest, lacking = (newest if alone else number), 0
            shown_s += [now_s] if now_s > shown_s[-1] else []
        else:
            lacking = number
        if now_s - told_s >= REPORT_S and generator.random() >= loss:
            told_s = now_s
            reports.append((now_s + ROUND_TRIP_S, lacking))
    pauses_s = np.diff([*shown_s, for_s])
    return float(pauses_s[pauses_s > STANDS_S].sum()) / (for_s - shown_s[0])


def test_where_a_fifth_is_lost_a_view_stands_still_only_while_steps_are_tried_again() -> None:
    assert standing_share(0.2, chooses=False) > 0.3
    assert standing_share(0.2, chooses=True) < 0.03


@pytest.mark.parametrize("loss", [0.0, 0.005])
def test_where_few_are_lost_steps_are_kept(loss: float) -> None:
    assert standing_share(loss, chooses=True) == standing_share(loss, chooses=False) < 0.02
