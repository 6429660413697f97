"""The simulated finger: monotone equilibria, and dynamics that do not depend on the step."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.dualsense.effects.official import (
    Feedback,
    MultiPositionFeedback,
    MultiPositionVibration,
    Off,
    SlopeFeedback,
    TriggerEffect,
    Vibration,
    Weapon,
)
from operator_side.dualsense.effects.unofficial_effects import Bow
from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL, TriggerFeedback
from operator_side.dualsense.simulated.trigger_model import (
    FINGER_TIME_CONSTANT_S,
    NORMAL_FINGER_FORCE_N,
    SPRING_PRELOAD_N,
    SPRING_RISE_N,
    STRENGTH_STEP_N,
    SimulatedTrigger,
    equilibrium_travel,
)

REPEATABLE = settings(derandomize=True, deadline=None)
FORCES = st.floats(0.0, 10.0)
STRENGTHS = st.tuples(*[st.integers(0, 8)] * 10)
WEAPONS = st.tuples(st.integers(2, 7), st.integers(3, 8), st.integers(1, 8)).map(
    lambda drawn: Weapon(min(drawn[0], drawn[1] - 1), drawn[1], drawn[2])
)
EFFECTS: st.SearchStrategy[TriggerEffect] = st.one_of(
    st.just(Off()), st.builds(MultiPositionFeedback, STRENGTHS), WEAPONS
)


def resistance_n(travel: float, strength: int) -> float:
    return SPRING_PRELOAD_N + SPRING_RISE_N * travel + STRENGTH_STEP_N * strength


def test_a_normal_pull_is_full_without_an_effect_and_overcomes_the_strongest() -> None:
    free = equilibrium_travel(NORMAL_FINGER_FORCE_N, (0,) * 10)
    assert free >= SENSED_TRAVEL
    hardest = equilibrium_travel(NORMAL_FINGER_FORCE_N, (8,) * 10)
    assert 0.25 <= hardest <= 0.6
    assert 0.25 <= hardest / SENSED_TRAVEL <= 0.6


@given(FORCES, STRENGTHS)
@REPEATABLE
def test_forces_balance_at_the_equilibrium(force_n: float, strengths: tuple[int, ...]) -> None:
    """Short of it everything yields to the finger; at it, or one zone on, the resistance holds."""
    travel = equilibrium_travel(force_n, strengths)
    assert 0.0 <= travel <= 1.0
    for zone in range(10):
        begin, end = zone / 10, min((zone + 1) / 10, travel)
        if begin < travel:
            assert resistance_n(end, strengths[zone]) <= force_n + 1e-9
    if 0.0 < travel < 1.0:
        # At a boundary, to rounding, either zone may be the one that holds.
        beside = {min(max(int(travel * 10 + one), 0), 9) for one in (-1e-9, 1e-9)}
        assert max(resistance_n(travel, strengths[zone]) for zone in beside) >= force_n - 1e-9


@given(FORCES, STRENGTHS, st.integers(0, 9))
@REPEATABLE
def test_equilibrium_never_grows_with_a_zones_strength(force_n: float, strengths: tuple[int, ...], zone: int) -> None:
    travels = [
        equilibrium_travel(force_n, (*strengths[:zone], strength, *strengths[zone + 1 :])) for strength in range(9)
    ]
    assert travels == sorted(travels, reverse=True)


@given(FORCES, FORCES, STRENGTHS)
@REPEATABLE
def test_equilibrium_never_falls_with_the_force(one: float, other: float, strengths: tuple[int, ...]) -> None:
    weak, strong = sorted((one, other))
    assert equilibrium_travel(weak, strengths) <= equilibrium_travel(strong, strengths)


def test_a_finger_rests_at_the_edge_of_a_stiffer_zone() -> None:
    strengths = (0,) * 5 + (8,) * 5
    travels = {equilibrium_travel(force_n, strengths) for force_n in (2.6, 3.0, 3.5, 4.4)}
    assert travels == {0.5}
    assert equilibrium_travel(2.4, strengths) < 0.5 < equilibrium_travel(4.6, strengths)


def test_relaxation_has_the_stated_time_constant() -> None:
    trigger = SimulatedTrigger()
    trigger.set_finger_force(NORMAL_FINGER_FORCE_N)
    trigger.advance(FINGER_TIME_CONSTANT_S)
    goal = equilibrium_travel(NORMAL_FINGER_FORCE_N, (0,) * 10)
    assert trigger.travel == pytest.approx(goal * (1.0 - math.exp(-1.0)), abs=1e-12)


@given(st.lists(st.tuples(FORCES, EFFECTS, st.floats(0.0, 0.5), st.integers(1, 300)), min_size=1, max_size=6))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_the_step_size_does_not_matter(phases: list[tuple[float, TriggerEffect, float, int]]) -> None:
    coarse, fine = SimulatedTrigger(), SimulatedTrigger()
    for force_n, effect, duration_s, steps in phases:
        for trigger in (coarse, fine):
            trigger.set_finger_force(force_n)
            trigger.set_effect(effect)
        coarse.advance(duration_s)
        for _ in range(steps):
            fine.advance(duration_s / steps)
        assert fine.travel == pytest.approx(coarse.travel, abs=1e-11)


@given(FORCES, EFFECTS, st.floats(0.0, 1e6))
@REPEATABLE
def test_no_step_is_too_long(force_n: float, effect: TriggerEffect, step_s: float) -> None:
    trigger = SimulatedTrigger()
    trigger.set_finger_force(force_n)
    trigger.set_effect(effect)
    trigger.advance(step_s)
    ends = {equilibrium_travel(force_n, effect.zone_strengths)}
    if trigger.feedback.status == 2:
        ends.add(equilibrium_travel(force_n, (0,) * 10))
    assert 0.0 <= trigger.travel <= max(ends)


def test_load() -> None:
    trigger = SimulatedTrigger()
    trigger.set_effect(Feedback(4, 8))
    trigger.advance(1.0)
    assert not trigger.loaded
    trigger.set_finger_force(1.5)
    trigger.advance(1.0)
    assert trigger.zone == 2
    assert not trigger.loaded  # short of the zone that resists
    trigger.set_finger_force(3.0)
    trigger.advance(1.0)
    assert trigger.travel == pytest.approx(0.4, abs=1e-9)
    assert trigger.loaded  # at rest against its edge
    trigger.set_finger_force(10.0)
    trigger.advance(1.0)
    assert trigger.zone == 9
    assert trigger.sensed_travel == 1.0
    assert trigger.loaded


def pulled(trigger: SimulatedTrigger, force_n: float, duration_s: float = 2.0) -> TriggerFeedback:
    trigger.set_finger_force(force_n)
    trigger.advance(duration_s)
    return trigger.feedback


def test_a_weapon_is_ready_fires_and_is_ready_again_once_let_go() -> None:
    trigger = SimulatedTrigger()
    trigger.set_effect(Weapon(3, 6, 8))
    assert pulled(trigger, 0.0) == TriggerFeedback(0, 0, 2)
    assert pulled(trigger, 1.5) == TriggerFeedback(2, 0, 2)  # short of it
    assert pulled(trigger, 3.5) == TriggerFeedback(3, 1, 2)  # against it
    assert trigger.travel == pytest.approx(0.3, abs=1e-9)
    fired = pulled(trigger, 5.0)  # beyond 0.5 + 4.0 * 0.6 + 8 * 0.25 newtons
    assert (fired.status, fired.active_effect) == (2, 2)
    assert trigger.travel == pytest.approx(1.0, abs=1e-9)
    # Letting go half way, it stays fired and holds nothing; back before zone 3 it is ready.
    assert pulled(trigger, 2.2) == TriggerFeedback(4, 2, 2)
    assert trigger.travel == pytest.approx((2.2 - 0.5) / 4.0, abs=1e-9)
    assert pulled(trigger, 1.0) == TriggerFeedback(1, 0, 2)
    assert pulled(trigger, 3.5).status == 1


def test_a_weapon_set_again_stays_as_fired_as_it_was() -> None:
    trigger = SimulatedTrigger()
    trigger.set_effect(Weapon(3, 6, 8))
    assert pulled(trigger, 5.0).status == 2
    assert pulled(trigger, 2.2).status == 2
    trigger.set_effect(Weapon(3, 6, 8))
    assert trigger.feedback.status == 2
    trigger.set_effect(Weapon(3, 6, 7))  # another one: it has not fired yet
    assert trigger.feedback.status == 1
    trigger.set_effect(Off())
    assert pulled(trigger, 5.0) == TriggerFeedback()
    trigger.set_effect(Weapon(3, 6, 8))  # a trigger that is beyond it already
    assert trigger.feedback.status == 2


def test_a_shot_comes_when_the_trigger_gets_there() -> None:
    """The time of the crossing follows from the exponential approach, whatever the step."""
    trigger = SimulatedTrigger()
    trigger.set_finger_force(6.0)
    trigger.set_effect(Weapon(2, 5, 4))
    held = 1.0  # 6 N overcome everything: the goal is the end of the travel
    crossing_s = FINGER_TIME_CONSTANT_S * math.log(held / (held - 0.5))
    trigger.advance(crossing_s - 1e-6)
    assert trigger.feedback.status == 1
    trigger.advance(2e-6)
    assert trigger.feedback.status == 2


@pytest.mark.parametrize("effect", [Vibration(4, 6, 30), MultiPositionVibration((0,) * 4 + (6,) * 6, 30)])
def test_vibration_moves_nothing_and_is_reported_where_it_shakes(effect: TriggerEffect) -> None:
    trigger = SimulatedTrigger()
    trigger.set_effect(effect)
    assert pulled(trigger, 1.5) == TriggerFeedback(2, 0, 3)
    assert pulled(trigger, 3.7) == TriggerFeedback(8, 1, 3)
    assert trigger.travel == pytest.approx(equilibrium_travel(3.7, (0,) * 10), abs=1e-9)


def test_a_slope_reports_like_any_feedback() -> None:
    trigger = SimulatedTrigger()
    trigger.set_effect(SlopeFeedback(0, 9, 1, 8))
    assert pulled(trigger, 3.0) == TriggerFeedback(4, 1, 1)


def test_unofficial_effects_report_as_other() -> None:
    trigger = SimulatedTrigger()
    trigger.set_effect(Bow(1, 4, 8, 8))
    assert pulled(trigger, 2.0) == TriggerFeedback()
    assert trigger.travel == pytest.approx(0.1, abs=1e-9)


def test_less_power_is_less_strength() -> None:
    trigger = SimulatedTrigger()
    trigger.set_finger_force(3.0)
    trigger.set_effect(Feedback(0, 8), power=0.5)
    trigger.advance(2.0)
    assert trigger.travel == pytest.approx(equilibrium_travel(3.0, (4,) * 10), abs=1e-9)
    with pytest.raises(ValueError, match=r"power = 1\.5"):
        trigger.set_effect(Off(), power=1.5)


# Another strongest effect than the assumed one

STEPS = st.floats(0.0, 1.0)


@given(FORCES, STRENGTHS, STEPS)
@REPEATABLE
def test_what_one_strength_resists_may_be_chosen(force_n: float, strengths: tuple[int, ...], step_n: float) -> None:
    """Twice the step is as good as twice the strength, and half the strengths as half the step."""
    halved = tuple(strength / 2 for strength in strengths)
    expected = equilibrium_travel(force_n, halved, step_n)
    assert equilibrium_travel(force_n, strengths, step_n / 2) == pytest.approx(expected, abs=1e-12)
    assert equilibrium_travel(force_n, strengths) == equilibrium_travel(force_n, strengths, STRENGTH_STEP_N)


@given(FORCES, STRENGTHS, STEPS, STEPS)
@REPEATABLE
def test_equilibrium_never_grows_with_the_step(
    force_n: float, strengths: tuple[int, ...], one: float, other: float
) -> None:
    light, heavy = sorted((one, other))
    assert equilibrium_travel(force_n, strengths, heavy) <= equilibrium_travel(force_n, strengths, light)


@pytest.mark.parametrize("strongest_n", [0.0, 1.5, 2.0, 3.0])
def test_the_strongest_effect_is_eight_steps(strongest_n: float) -> None:
    trigger = SimulatedTrigger(strongest_n / 8)
    trigger.set_effect(Feedback(0, 8))
    pulled(trigger, 4.0)
    assert trigger.travel == pytest.approx((4.0 - SPRING_PRELOAD_N - strongest_n) / SPRING_RISE_N, abs=1e-9)
    # Less power is less of it.
    trigger.set_effect(Feedback(0, 8), power=0.5)
    trigger.advance(2.0)
    assert trigger.travel == pytest.approx((4.0 - SPRING_PRELOAD_N - strongest_n / 2) / SPRING_RISE_N, abs=1e-9)


def test_the_usual_step_makes_two_newtons_of_the_strongest_effect() -> None:
    assert pytest.approx(2.0) == 8 * STRENGTH_STEP_N
    usual, chosen = SimulatedTrigger(), SimulatedTrigger(STRENGTH_STEP_N)
    for trigger in (usual, chosen):
        trigger.set_effect(MultiPositionFeedback((0, 0, 3, 3, 8, 8, 8, 8, 8, 8)))
    assert pulled(usual, 3.0) == pulled(chosen, 3.0)
    assert usual.travel == chosen.travel


def test_without_a_step_effects_are_told_and_not_felt() -> None:
    trigger = SimulatedTrigger(0.0)
    trigger.set_effect(Feedback(0, 8))
    feedback = pulled(trigger, 3.0)
    assert trigger.travel == pytest.approx(equilibrium_travel(3.0, (0,) * 10), abs=1e-9)
    assert feedback.active_effect == 1
    assert trigger.effect == Feedback(0, 8)


def test_arguments_out_of_range() -> None:
    trigger = SimulatedTrigger()
    for force_n in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="finger_force_n"):
            trigger.set_finger_force(force_n)
    for step_s in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="step_s"):
            trigger.advance(step_s)
    with pytest.raises(ValueError, match="zone_strengths"):
        equilibrium_travel(1.0, (1,) * 9)
    with pytest.raises(ValueError, match="zone_strengths"):
        equilibrium_travel(1.0, (9,) * 10)
    for step_n in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="strength_step_n"):
            equilibrium_travel(1.0, (1,) * 10, step_n)
        with pytest.raises(ValueError, match="strength_step_n"):
            SimulatedTrigger(step_n).set_finger_force(1.0)
