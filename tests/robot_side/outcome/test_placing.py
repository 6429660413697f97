"""When a target counts as placed, and its contact as felt in advance, for a target whose motion the test makes up."""

import math

import numpy as np
import pytest

from robot_side.outcome.placing import Placing
from robot_side.tick.truth import TargetTruth


def at(gap_m: float, sinking_m_s: float = 0.0, tilt_rad: float = 0.0, x_m: float = 0.0) -> TargetTruth:
    return TargetTruth(np.array([x_m, 0.0, 0.06 + gap_m]), gap_m, sinking_m_s, tilt_rad)


def set_down(
    warned_from_m: float | None = 0.03, tilt_rad: float = 0.0, let_go_at_m: float = -1.0
) -> tuple[Placing, float]:
    """Lift a target by 100 mm, lower it at 20 mm/s and release it on the table, or at the height `let_go_at_m`.

    Return the figures and the time of contact.
    """
    placing, now_s = Placing(), 0.0
    placing.observe(at(0.0), False, False, now_s)
    gap_m = 0.1
    while gap_m > 0.0:
        warned = warned_from_m is not None and gap_m <= warned_from_m
        placing.observe(at(gap_m, 0.02, x_m=0.05), gap_m > let_go_at_m, warned, now_s)
        gap_m, now_s = gap_m - 2e-4, now_s + 0.01
    placing.observe(at(-1e-4, 0.0, tilt_rad, 0.05), let_go_at_m < 0.0, False, now_s)
    placing.observe(at(-1e-4, 0.0, tilt_rad, 0.05), False, False, now_s + 1.0)
    return placing, now_s


def test_what_is_set_down_upright_and_let_go_is_placed() -> None:
    placing, touched_s = set_down()
    said = placing.summary(1.0)
    assert said["placed"]
    assert said["time_s"] == pytest.approx(touched_s)
    assert said["contact_speed_mm_s"] == pytest.approx(20.0)
    assert said["felt_before_mm"] == pytest.approx(30.0, abs=0.3)
    assert said["felt_before_s"] == pytest.approx(1.5, abs=0.02)
    assert said["moved_mm"] == pytest.approx(50.0)
    assert said["off_support_mm"] == pytest.approx(-0.1)


@pytest.mark.parametrize("tilt_deg", [11.0, 90.0])
def test_what_has_toppled_is_not_placed(tilt_deg: float) -> None:
    assert not set_down(tilt_rad=math.radians(tilt_deg))[0].placed


def test_what_fell_is_not_placed_however_it_stands() -> None:
    said = set_down(let_go_at_m=0.05)[0].summary(0.0)
    assert (said["placed"], said["time_s"], said["contact_speed_mm_s"]) == (False, None, None)


def test_what_is_still_held_is_not_placed_and_what_was_never_lifted_neither() -> None:
    placing = Placing()
    for now_s, (gap_m, held) in enumerate([(0.0, False), (0.0, True), (0.0, False)]):
        placing.observe(at(gap_m), held, False, float(now_s))
        assert not placing.placed
    for now_s, gap_m in enumerate([0.1, -1e-4]):
        placing.observe(at(gap_m), True, False, 10.0 + now_s)
    assert not placing.placed


def test_a_warning_counts_from_its_last_beginning() -> None:
    placing = Placing()
    for now_s, gap_m, warned in [(0.0, 0.1, True), (0.1, 0.09, False), (1.0, 0.05, True), (1.4, 0.02, True)]:
        placing.observe(at(gap_m), True, warned, now_s)
    placing.observe(at(0.0), True, True, 1.6)
    assert placing.felt_s == pytest.approx(0.6)
    assert placing.felt_m == pytest.approx(0.05)
