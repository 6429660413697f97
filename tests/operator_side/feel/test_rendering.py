import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.messages import Header, StiffnessUpdate, TriggerField
from common.protocol.uniform_field import FAR_M, uniform_field
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel, Rumble
from operator_side.feel.commands_under_way import Displacement
from operator_side.feel.rendering import RenderedTrigger, RenderingSettings, TriggerRendering
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from tests.helpers.messages import field, onsets, uniform_update

USUAL = RenderingSettings()
STILL = Displacement(0.0, 0.0)
LET_GO = (0.0, 0.0)
HEADER = Header(1, 1, 1.0)
PARTED = field(onsets(0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.10))


def rendered(strength: int, trigger: RenderedTrigger, now_s: float) -> tuple[int, ...]:
    return trigger.render(uniform_field(strength), FAR_M, 0.0, STILL, now_s)


def update(l2: TriggerField, r2: TriggerField, speed_m_s: float = 0.0, horizon_m: float = 1.0) -> StiffnessUpdate:
    return StiffnessUpdate(HEADER, l2, r2, speed_m_s=speed_m_s, horizon_m=horizon_m, rumble=0.0, state="armed")


def zones(output: Feel) -> tuple[tuple[int, ...], tuple[int, ...]]:
    assert output.l2 is not None
    assert output.r2 is not None
    return output.l2, output.r2


def test_strength_rises_at_once_and_falls_over_a_tenth_of_a_second() -> None:
    trigger = RenderedTrigger(USUAL, TriggerTravel())
    assert rendered(3, trigger, 1.0) == (3,) * 10
    assert rendered(8, trigger, 1.0) == (8,) * 10
    shown = [rendered(0, trigger, 1.0 + 0.001 * step)[0] for step in range(1, 101)]
    assert [shown.index(strength) + 1 for strength in (7, 6, 5, 4, 3, 2, 1, 0)] == [13, 25, 38, 50, 63, 75, 88, 100]
    assert rendered(2, trigger, 1.1) == (2,) * 10


def test_a_release_does_not_fall() -> None:
    trigger = RenderedTrigger(USUAL, TriggerTravel())
    rendered(8, trigger, 1.0)
    trigger.release()
    assert rendered(0, trigger, 1.0) == (0,) * 10
    rendering = TriggerRendering(USUAL, TravelCalibration())
    stiff = rendering.render(uniform_update(HEADER, l2=8, r2=8, rumble=0.5), LET_GO, None, 1.0)
    assert stiff == Feel((8,) * 10, (8,) * 10, Rumble(left=0.5))
    assert rendering.render(None, LET_GO, None, 1.0) == RELEASED
    assert rendering.render(uniform_update(HEADER), LET_GO, None, 1.0) == RELEASED


def test_a_contact_is_signalled_by_one_short_pulse_of_the_right_motor() -> None:
    rendering = TriggerRendering(USUAL, TravelCalibration())

    def motors(stands: bool, now_s: float, rumble: float = 0.0) -> Rumble | None:
        return rendering.render(uniform_update(HEADER, stands=stands, rumble=rumble), LET_GO, None, now_s).rumble

    assert motors(False, 1.0) == Rumble()
    assert motors(True, 1.001) == Rumble(0.0, 0.7)
    assert motors(True, 1.08, rumble=0.5) == Rumble(0.5, 0.7)
    assert motors(True, 1.082) == motors(True, 9.0) == motors(False, 9.001) == Rumble()
    assert motors(True, 9.002) == Rumble(0.0, 0.7)
    assert rendering.render(None, LET_GO, None, 9.01) == RELEASED
    # An object that is still set down when stiffness messages are back causes no pulse.
    assert motors(True, 20.0) == Rumble()


def test_an_arm_that_begins_not_to_follow_is_signalled_by_two_short_pulses() -> None:
    rendering = TriggerRendering(USUAL, TravelCalibration())
    rendering.render(uniform_update(HEADER), LET_GO, None, 0.9995)
    drives = []
    for now_ms in range(1000, 2000):
        rumble = rendering.render(uniform_update(HEADER, hindered=True, rumble=0.5), LET_GO, None, 1e-3 * now_ms).rumble
        assert rumble is not None
        assert rumble.left == 0.5
        drives.append(rumble.right)
    edges = [now_ms for now_ms in range(1, 1000) if drives[now_ms] != drives[now_ms - 1]]
    assert drives[0] == 0.4
    assert edges == pytest.approx([60, 140, 200], abs=1)


@given(st.lists(st.tuples(st.integers(0, 8), st.floats(0.0, 0.2)), max_size=30), st.integers(0, 8))
def test_after_any_past_it_is_never_weaker_than_asked_for_and_soon_no_stronger(
    past: list[tuple[int, float]], last: int
) -> None:
    trigger, now_s = RenderedTrigger(USUAL, TriggerTravel()), 0.0
    for strength, step_s in past:
        assert min(rendered(strength, trigger, now_s)) >= strength
        now_s += step_s
    shown = rendered(last, trigger, now_s)
    assert list(shown) == sorted(shown)
    rendered(last, trigger, now_s + 0.05)
    assert rendered(last, trigger, now_s + 0.1 + 1e-9) == (last,) * 10


def test_each_trigger_gets_its_own_zones_with_the_displacement_and_the_other_triggers_pull() -> None:
    def shown(moving: Displacement | None, pulled: tuple[float, float] = LET_GO) -> tuple[tuple[int, ...], ...]:
        return zones(TriggerRendering(USUAL, TravelCalibration()).render(update(PARTED, PARTED), pulled, moving, 0.0))

    still, moved = shown(STILL), shown(Displacement(0.02, 0.0))
    assert still[0] == still[1]
    assert sum(moved[0]) < sum(still[0]) < sum(moved[1])
    assert shown(None) == still
    assert shown(STILL, (0.0, 1.0)) == ((0,) * 10, still[1])


def test_with_swapped_sides_each_gets_the_others() -> None:
    calibration = TravelCalibration(l2=TriggerTravel(0.05, 0.5))
    ahead, moved = update(uniform_field(1), PARTED), Displacement(0.01, 0.05)
    swapped = TriggerRendering(USUAL, calibration, swap_sides=True).render(ahead, (0.0, 0.3), moved, 0.0)
    plain = RenderedTrigger(USUAL, calibration.l2).render(PARTED, 1.0, 0.0, moved, 0.0)
    assert swapped.l2 == plain
    assert swapped.r2 is not None
    assert swapped.r2[-1] == 1
    assert swapped.r2[0] == 0  # It retreats only once it is pulled farther than the advancing trigger.


def test_the_run_says_which_zones_were_stiff_and_how_many_for_want_of_knowing() -> None:
    rendering = TriggerRendering(USUAL, TravelCalibration())
    free = {"first_stiff": None, "max": 0}
    assert rendering.zones() == {"l2": free, "r2": free}
    rendering.render(update(uniform_field(0), field(onsets(0.06, 0.2)), horizon_m=FAR_M), LET_GO, STILL, 0.0)
    assert rendering.zones() == {"l2": free, "r2": {"first_stiff": 5, "max": 1}}
    rendering.render(None, LET_GO, None, 1.0)
    rendering.render(update(uniform_field(0), field(onsets(1.0)), horizon_m=0.08), LET_GO, STILL, 2.0)
    assert rendering.zones() == {"l2": {"first_stiff": 7, "max": 8}, "r2": {"first_stiff": 5, "max": 8}}
    assert rendering.summary() == {"l2": {"beyond_horizon": 3}, "r2": {"beyond_horizon": 3}}


def test_people_are_told_the_free_way_as_they_are_told_how_far_they_pull() -> None:
    trigger = RenderedTrigger(USUAL, TriggerTravel(0.0, 1.0))
    assert trigger.free_travel == 1.0
    trigger.render(field(onsets(0.06)), 1.0, 0.0, STILL, 0.0)
    assert trigger.free_travel == pytest.approx(0.5 / 0.75)  # Zone 5 begins at 0.5 of the travel, 0.75 of it sensed.
    trigger.render(field(onsets(0.04, 0.045, 0.06)), 1.0, 0.0, STILL, 1.0)
    assert trigger.free_travel == pytest.approx(0.4 / 0.75)
    trigger.release()
    assert trigger.render(field(onsets(0.0855)), 1.0, 0.0, STILL, 2.0) == FREE_TRIGGER
    short = RenderedTrigger(USUAL, TriggerTravel(0.0, 0.88))  # A full pull ends at 0.66.
    assert short.render(field(onsets(0.085)), 1.0, 0.0, STILL, 0.0) == (0,) * 7 + (8,) * 3
    assert short.free_travel == 1.0
