import dataclasses
import itertools
import math
from typing import Any

import pytest

from common.protocol.messages import Telemetry, Vector3
from common.status.codes import Doing
from operator_side.controller.feel import FREE_TRIGGER, SENSED_TRAVEL, USUAL_LIGHT, WARNING_LIGHT, Color, Feel, Rumble
from operator_side.controller.state import Button
from operator_side.dualsense.simulated.trigger_model import SPRING_PRELOAD_N, SPRING_RISE_N
from operator_side.people.person import FULL_STICK_M_S, FULL_TRIGGER_M_S, GENTLY_M_S
from operator_side.people.settings import PersonSettings
from tests.helpers.messages import feedback
from tests.helpers.simulated_desk import (
    CALIBRATION,
    CLEAR_SIGHTED,
    FRAME_S,
    GRASP_M,
    TICK_S,
    VIEW,
    Desk,
    PersonInput,
    armed,
    crossover,
    habitual_force_n,
    view,
)


@pytest.mark.parametrize("reaction_s", [0.0, 0.1, 0.25, 0.5])
def test_nothing_is_answered_before_the_reaction_time(reaction_s: float) -> None:
    settings = PersonSettings(depth_error_sd_m=0.0, visual_reaction_s=reaction_s)
    desk = Desk(settings)
    desk.arm(armed(None))
    desk.watch(armed(None), 1.0)
    assert desk.hands[-1].r2_n == 0.0
    appeared_s = desk.now_s
    seen = desk.watch(armed((0.0, 0.0, 0.2)), 1.0)
    acted_s = next(hands.now_s for hands in seen if hands.r2_n > 0.0)
    assert reaction_s - 1e-9 <= acted_s - appeared_s <= reaction_s + TICK_S


UP_AT_M = 0.41
"""Height of the tool, in metres, at which an object that was gripped at 0.3 m is carried"""


def at_height(height_m: float, back_m: float = 0.44, *, holding: bool = True, **changes: Any) -> Telemetry:
    return armed(holding=holding, tool_position_m=(back_m, 0.0, height_m), **changes)


def carried(settings: PersonSettings = CLEAR_SIGHTED) -> Desk:
    desk = Desk(settings)
    desk.arm()
    desk.until(Doing.LIFTING, armed(holding=True), 3.0)
    desk.until(Doing.CARRYING, at_height(UP_AT_M, 0.5), 1.0)
    desk.until(Doing.LOWERING, at_height(UP_AT_M), 1.0)
    return desk


def sinks(desk: Desk, from_m: float, to_m: float, speed_m_s: float) -> None:
    height_m = from_m
    while height_m > to_m:
        desk.watch(at_height(height_m), FRAME_S)
        height_m -= speed_m_s * FRAME_S


def stick_speed_m_s(hands: PersonInput) -> float:
    return -FULL_STICK_M_S * CALIBRATION.left_stick.deflection(hands.left)[1]


def test_the_task_from_waiting_to_withdrawing() -> None:
    desk = Desk(start_s=1e6)
    for hands in desk.watch(None, 3.0):
        assert (hands.l2_n, hands.r2_n, hands.left, hands.buttons) == (0.0, 0.0, (0.0, 0.0), frozenset({Button.L1}))
        assert hands.phase == Doing.RESTING
    # The person sees the first telemetry one reaction late, and arming requires a rest while the link is up.
    assert 1.2 < desk.until(Doing.ARMING, VIEW, 3.0) < 1.5
    assert all(hands.buttons == {Button.L1, Button.OPTIONS} for hands in desk.watch(VIEW, 0.1))
    desk.until(Doing.ADVANCING, armed((0.0, 0.0, 0.3)), 0.5)
    assert desk.watch(armed((0.0, 0.0, 0.3)), 1.0)[-1].r2_n > 0.0
    assert desk.person.doing == "advancing"
    desk.until(Doing.GRASPING, armed(), 0.5)
    closing = desk.watch(armed(), 0.2)
    assert all(Button.CROSS in hands.buttons for hands in closing)
    assert closing[-1].r2_n == closing[-1].l2_n == 0.0
    desk.until(Doing.LIFTING, armed(holding=True), 1.0)
    desk.watch(armed(holding=True), 1.0)
    # They carry the object back horizontally, no farther than intended.
    desk.until(Doing.CARRYING, at_height(UP_AT_M, 0.5), 0.5)
    back = desk.watch(at_height(UP_AT_M, 0.5), 0.5)[-1]
    assert (back.l2_n > 0.0, back.r2_n, back.left, Button.CROSS in back.buttons) == (True, 0.0, (0.0, 0.0), True)
    assert 0.0 < desk.watch(at_height(UP_AT_M, 0.46), 1.0)[-1].l2_n < back.l2_n
    desk.until(Doing.LOWERING, at_height(UP_AT_M), 0.5)
    # An object that sinks a little before it is lowered does not count as set down.
    sinks(desk, UP_AT_M, UP_AT_M - 0.004, 0.01)
    lowering = desk.watch(at_height(UP_AT_M - 0.004), 1.0)[-1]
    assert lowering.phase == Doing.LOWERING
    assert stick_speed_m_s(lowering) == pytest.approx(0.05, abs=1e-6)
    sinks(desk, UP_AT_M, 0.32, 0.05)
    assert desk.person.phase == Doing.LOWERING
    desk.until(Doing.LETTING_GO, at_height(0.32), 1.0)
    assert all(hands.buttons == {Button.L1, Button.SQUARE} for hands in desk.watch(at_height(0.32), 0.5)[1:])
    # First up, as they have pressed the object down, then back.
    rising = desk.watch(at_height(0.32, holding=False), 1.0)[-1]
    assert (rising.phase, stick_speed_m_s(rising) < 0.0) == (Doing.LETTING_GO, True)
    desk.until(Doing.DRAWING_BACK, at_height(0.335, holding=False), 0.5)
    assert desk.watch(at_height(0.335, holding=False), 0.5)[-1].l2_n > 0.0
    desk.until(Doing.DONE, at_height(0.335, 0.33, holding=False), 0.5)
    for hands in desk.watch(at_height(0.335, 0.33, holding=False), 1.0):
        assert (hands.l2_n, hands.r2_n, hands.left, hands.buttons) == (0.0, 0.0, (0.0, 0.0), frozenset({Button.L1}))
    assert all(Button.L1 in hands.buttons and hands.right == (0.0, 0.0) for hands in desk.hands)


def test_a_rest_while_the_link_is_lost_does_not_count() -> None:
    desk = Desk()
    desk.until(Doing.ARMING, VIEW, 3.0)
    desk.tell(Feel(light=WARNING_LIGHT))
    assert all(hands.buttons == {Button.L1} for hands in desk.watch(VIEW, 3.0))
    desk.tell(Feel(light=USUAL_LIGHT))
    assert 1.2 < desk.until(Doing.ARMING, VIEW, 3.0) < 1.8


@pytest.mark.parametrize("marks", [False, True])
@pytest.mark.parametrize(("dropped", "result"), [(False, Button.RIGHT), (True, Button.LEFT)])
def test_a_person_who_marks_episodes_marks_start_and_result(marks: bool, dropped: bool, result: Button) -> None:
    desk = carried(dataclasses.replace(CLEAR_SIGHTED, marks=marks))
    if not dropped:
        sinks(desk, UP_AT_M, 0.32, 0.05)
        desk.until(Doing.LETTING_GO, at_height(0.32), 1.0)
        desk.until(Doing.DRAWING_BACK, at_height(0.335, holding=False), 1.0)
    desk.until(Doing.DONE, at_height(0.335, 0.33, holding=False), 2.0)
    desk.watch(at_height(0.335, 0.33, holding=False), 1.0)
    pad = {Button.UP, Button.DOWN, Button.LEFT, Button.RIGHT}
    pressed = [(pad & hands.buttons, hands.phase) for hands in desk.hands]
    changes = [one for one, _ in itertools.groupby(pressed, key=lambda found: frozenset(found[0]))]
    assert [*map(set, changes)] == ([set(), {Button.UP}, set(), {result}, set()] if marks else [set()])
    assert {phase for button, phase in pressed if button == {result}} == ({Doing.DONE} if marks else set())


@pytest.mark.parametrize("trust", [0.0, 1.0])
def test_a_trusting_person_lowers_gently_from_a_reaction_after_rumble_until_contact(trust: float) -> None:
    desk = carried(dataclasses.replace(CLEAR_SIGHTED, trust=trust))
    sinks(desk, UP_AT_M, 0.38, 0.05)
    desk.tell(Feel(rumble=Rumble(left=0.25)))
    felt_s = desk.now_s
    sinks(desk, 0.38, 0.35, 0.05)
    eased = [h.now_s for h in desk.hands if h.now_s >= felt_s and stick_speed_m_s(h) < 1.01 * GENTLY_M_S]
    assert bool(eased) == bool(trust)
    assert all(eased_s - felt_s > 0.15 for eased_s in eased)
    # The person stays gentle: the object that was felt is still there.
    desk.tell(Feel(rumble=Rumble()))
    assert (stick_speed_m_s(desk.watch(at_height(0.35), 0.3)[-1]) < 1.01 * GENTLY_M_S) == bool(trust)


@pytest.mark.parametrize("state", ["disarmed", "stopped"])
def test_a_stopped_robot_makes_them_release_and_restart(state: str) -> None:
    desk = Desk()
    desk.arm()
    assert desk.watch(armed((0.0, 0.0, 0.3)), 1.0)[-1].r2_n > 0.0
    stopped = desk.watch(view(state=state), 1.0)
    assert [hands.r2_n == 0.0 for hands in stopped].index(True) * TICK_S == pytest.approx(0.25, abs=2 * TICK_S)
    assert stopped[-1].phase == Doing.RESTING
    desk.until(Doing.ARMING, view(state=state), 2.0)


@pytest.mark.parametrize(("depth_m", "trigger"), [(0.05, "r2_n"), (0.2, "r2_n"), (-0.03, "l2_n"), (-0.3, "l2_n")])
@pytest.mark.parametrize(("delay_s", "adapts"), [(0.0, True), (0.2, True), (1.0, True), (1.0, False)])
def test_they_pull_as_far_as_distance_and_delay_ask_for(
    depth_m: float, trigger: str, delay_s: float, adapts: bool
) -> None:
    desk = Desk(dataclasses.replace(CLEAR_SIGHTED, adapts_to_delay=adapts))
    desk.arm()
    pulled = desk.watch(armed((0.0, 0.0, depth_m - GRASP_M)), 1.0, delay_s)[-1]
    meant = min(1.0, crossover(0.25 + adapts * delay_s) * abs(depth_m) / FULL_TRIGGER_M_S)
    assert getattr(pulled, trigger) == pytest.approx(habitual_force_n(meant))
    assert min(pulled.l2_n, pulled.r2_n) == 0.0


@pytest.mark.parametrize(
    ("across_m", "direction"),
    [((0.05, 0.0), (1.0, 0.0)), ((-0.05, 0.0), (-1.0, 0.0)), ((0.0, 0.05), (0.0, -1.0)), ((0.0, -0.05), (0.0, 1.0))],
)
def test_the_stick_goes_to_where_the_target_is_seen(
    across_m: tuple[float, float], direction: tuple[float, float]
) -> None:
    """The tool's y axis points down on the screen, the stick's y axis up."""
    desk = Desk()
    desk.arm()
    hands = desk.watch(armed((*across_m, 0.2)), 1.0)[-1]
    length = math.hypot(*hands.left)
    assert length > CALIBRATION.left_stick.dead_zone
    assert (hands.left[0] / length, hands.left[1] / length) == pytest.approx(direction)
    # At this distance of the target from the tool axis, they centre first.
    assert hands.r2_n == 0.0


@pytest.mark.parametrize("up", [(0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, 0.0, -0.8)])
def test_lifting_goes_up_whichever_way_the_tool_points(up: Vector3) -> None:
    desk = Desk()
    desk.arm()
    # From above they grasp as far above the target's centre as they grasp beyond it from elsewhere.
    ahead_m = GRASP_M if up[2] < -0.5 else -GRASP_M
    screen = armed((0.0, 0.0, ahead_m), holding=True, up_in_tool=up)
    desk.until(Doing.LIFTING, screen, 3.0)
    hands = desk.watch(screen, 1.0)[-1]
    x, y = CALIBRATION.left_stick.deflection(hands.left)
    # Right, down and forward in the tool's frame, each as a share of full speed.
    assert (x, -y) == pytest.approx((0.5 * up[0], 0.5 * up[1]), abs=1e-9)
    for side, force_n in ((1, hands.r2_n), (-1, hands.l2_n)):
        meant = max(0.0, 0.5 * side * up[2])
        assert force_n == pytest.approx(habitual_force_n(meant) if meant > 0.0 else 0.0)
    assert Button.CROSS in hands.buttons


def test_between_attempts_they_open_and_draw_back_and_in_the_end_they_give_up() -> None:
    desk = Desk(dataclasses.replace(CLEAR_SIGHTED, attempts=2))
    desk.arm()
    desk.until(Doing.RETREATING, armed(), 5.0)
    for hands in desk.watch(armed(), 0.5)[1:]:
        assert hands.buttons == {Button.L1, Button.SQUARE}
        assert hands.l2_n >= habitual_force_n(0.4)
        assert hands.r2_n == 0.0
    assert desk.until(Doing.ADVANCING, armed(), 1.0) == pytest.approx(0.5, abs=3 * TICK_S)
    desk.until(Doing.DONE, armed(), 12.0)
    phases = [hands.phase for hands in desk.hands]
    assert sum(pair == (Doing.GRASPING, Doing.ADVANCING) for pair in zip(phases[1:], phases, strict=False)) == 2
    assert {hands.buttons for hands in desk.watch(armed(), 3.0)[1:]} == {frozenset({Button.L1})}


TOWARDS = armed((0.0, 0.0, 0.06))


@pytest.mark.parametrize(
    ("strength", "noticeable", "eases"), [(0, 0.07, False), (1, 0.07, True), (8, 0.07, True), (1, 0.5, False)]
)
def test_a_trusting_person_eases_off_a_reaction_after_a_stiffer_trigger(
    strength: int, noticeable: float, eases: bool
) -> None:
    desk = Desk(dataclasses.replace(CLEAR_SIGHTED, noticeable_force=noticeable))
    desk.arm()
    desk.watch(TOWARDS, 1.0)
    force_n, felt_s = desk.hands[-1].r2_n, desk.now_s
    desk.resist(feedback(0, strength) if strength else FREE_TRIGGER)
    eased = [hands.now_s for hands in desk.watch(TOWARDS, 0.6) if hands.r2_n < force_n]
    assert bool(eased) is eases
    if eased:
        assert 0.15 < eased[0] - felt_s < 0.5
        assert desk.hands[-1].r2_n == pytest.approx(habitual_force_n(GENTLY_M_S / FULL_TRIGGER_M_S))


@pytest.mark.parametrize(("trust", "light"), [(1.0, USUAL_LIGHT), (0.0, USUAL_LIGHT), (1.0, WARNING_LIGHT)])
def test_a_person_who_feels_the_contact_pulse_releases_a_reaction_later(trust: float, light: Color) -> None:
    desk = carried(dataclasses.replace(CLEAR_SIGHTED, trust=trust))
    desk.watch(at_height(UP_AT_M), 0.5)
    desk.tell(dataclasses.replace(Feel(rumble=Rumble(left=1.0, right=0.7)), light=light))
    seen = desk.watch(at_height(UP_AT_M), 0.08)
    desk.tell(Feel(rumble=Rumble()))
    seen += desk.watch(at_height(UP_AT_M), 0.5)
    let_go = [step * TICK_S for step, hands in enumerate(seen) if Button.SQUARE in hands.buttons]
    assert bool(let_go) is (trust == 1.0 and light == USUAL_LIGHT)
    if let_go:
        assert 0.15 < let_go[0] < 0.5
        assert seen[-1].left == (0.0, 0.0)


@pytest.mark.parametrize("strength", [0, 1, 8])
def test_from_above_they_press_a_stiff_trigger_harder_in_steps_to_2_n_before_they_let_go(strength: int) -> None:
    def above(height_m: float) -> Telemetry:
        return at_height(height_m, 0.5, up_in_tool=(0.0, 0.0, -1.0))

    desk = Desk()
    desk.arm()
    desk.until(Doing.LIFTING, armed((0.0, 0.0, GRASP_M), holding=True, up_in_tool=(0.0, 0.0, -1.0)), 3.0)
    desk.until(Doing.LOWERING, above(UP_AT_M), 3.0)
    for step in range(120):
        desk.watch(above(UP_AT_M - 0.001 * step), FRAME_S)
    desk.resist(feedback(0, strength) if strength else FREE_TRIGGER)
    begins = len(desk.hands)
    desk.until(Doing.LETTING_GO, above(UP_AT_M - 0.12), 6.0)
    pressed = {round(habitual_force_n(k * GENTLY_M_S / FULL_TRIGGER_M_S), 6) for k in (1, 2, 3, 4, 5)}
    seen = [round(hands.r2_n, 6) for hands in desk.hands[begins:] if hands.phase == Doing.LOWERING]
    assert seen == sorted(seen)
    assert set(seen) == (pressed if strength else {min(pressed)})
    assert max(pressed) == pytest.approx(2.0, abs=0.1)


def test_an_object_that_is_stopped_from_the_first_is_let_go_at_last() -> None:
    desk = carried()
    assert 2.5 < desk.until(Doing.LETTING_GO, at_height(UP_AT_M), 5.0) < 4.0


def test_they_draw_back_only_as_far_as_the_arm_can() -> None:
    desk = carried()
    desk.until(Doing.LETTING_GO, at_height(UP_AT_M), 5.0)
    desk.until(Doing.DRAWING_BACK, at_height(UP_AT_M + 0.02, holding=False), 5.0)
    assert 2.0 < desk.until(Doing.DONE, at_height(UP_AT_M + 0.02, 0.4, holding=False), 5.0) < 4.0


def test_at_the_warning_light_they_rest_their_hands_and_go_on_a_moment_after_it() -> None:
    desk = Desk()
    desk.arm()
    desk.watch(TOWARDS, 1.0)
    desk.tell(Feel(light=WARNING_LIGHT))
    for hands in desk.watch(TOWARDS, 1.0):
        assert (hands.l2_n, hands.r2_n, hands.left) == (0.0, 0.0, (0.0, 0.0))
        assert hands.buttons == {Button.L1}
    desk.tell(Feel(light=USUAL_LIGHT))
    pulled = [hands.r2_n > 0.0 for hands in desk.watch(TOWARDS, 1.0)]
    assert pulled.index(True) * TICK_S == pytest.approx(0.5, abs=2 * TICK_S)
    assert all(pulled[pulled.index(True) :])


def test_a_person_who_moves_and_waits_moves_the_seen_distance_and_looks_after_the_delay() -> None:
    desk = Desk(dataclasses.replace(CLEAR_SIGHTED, aiming="move-and-wait"))
    desk.arm(armed((0.0, 0.0, 0.2)))
    delay_s, seen = 0.4, desk.watch(armed((0.0, 0.0, 0.2)), 6.0, 0.4)
    pulled = [hands.r2_n > 0.0 for hands in seen]
    first, ends = pulled.index(True), pulled.index(False, pulled.index(True))
    again = pulled.index(True, ends)
    assert (again - ends) * TICK_S == pytest.approx(delay_s + 0.25, abs=0.1)
    # The path of a minimum-jerk move, by the intended travel, which the finger follows with a lag.
    meant = [habitual_travel(hands.r2_n) * FULL_TRIGGER_M_S * TICK_S for hands in seen[first:ends]]
    assert sum(meant) == pytest.approx(0.2 + GRASP_M, rel=0.02)


def habitual_travel(force_n: float) -> float:
    """Return the calibrated travel that a free trigger would have under this force."""
    return (
        0.0 if force_n == 0.0 else CALIBRATION.r2.travel((force_n - SPRING_PRELOAD_N) / SPRING_RISE_N / SENSED_TRAVEL)
    )


def test_misjudged_distances_spread_as_they_are_said_to() -> None:
    errors_m = []
    for seed in range(60):
        desk = Desk(PersonSettings(depth_error_sd_m=0.01, grasp_depth_m=GRASP_M), seed)
        desk.arm()
        force_n = desk.watch(armed((0.0, 0.0, 0.1)), 0.3)[-1].r2_n
        free = ((force_n - SPRING_PRELOAD_N) / SPRING_RISE_N) / SENSED_TRAVEL
        errors_m.append(CALIBRATION.r2.travel(free) * FULL_TRIGGER_M_S / crossover(0.25) - 0.1 - GRASP_M)
    mean = sum(errors_m) / 60
    sd = math.sqrt(sum((error - mean) ** 2 for error in errors_m) / 59)
    # Three standard errors.
    assert abs(mean) < 3 * 0.01 / math.sqrt(60)
    assert sd == pytest.approx(0.01, rel=3 / math.sqrt(2 * 59))
