"""From stiffness, contact and time to what both triggers do."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.messages import Header, StiffnessUpdate
from operator_side.dualsense.effects.official import MultiPositionFeedback, Off
from operator_side.dualsense.reports.output_report import RELEASED, Rumble
from operator_side.feel.bands import Band, BandSettings
from operator_side.feel.rendering import RenderedTrigger, RenderingSettings, RumbleSelector, TriggerRendering
from operator_side.feel.sustained_force import SustainedForceSettings
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel

REPEATABLE = settings(derandomize=True, deadline=None)
USUAL = RenderingSettings()
STIFFNESS = st.floats(0.0, 1.0)
CONTACT = st.none() | STIFFNESS
MOMENTS = st.lists(st.tuples(STIFFNESS, CONTACT, st.floats(0.0, 20.0)))


def update(**fields: float | None) -> StiffnessUpdate:
    values = {"l2": 0.0, "r2": 0.0, "rumble": 0.0} | fields
    return StiffnessUpdate(Header(1, 1, 1.0), state="armed", **values)  # type: ignore[arg-type]


@given(MOMENTS, STIFFNESS, STIFFNESS, CONTACT, st.sampled_from([0.3, 0.9, 0.98]), st.booleans())
@REPEATABLE
def test_after_any_past_more_stiffness_never_makes_any_zone_weaker(
    past: list[tuple[float, float | None, float]],
    one: float,
    other: float,
    contact: float | None,
    saturation: float,
    marked: bool,
) -> None:
    strengths = []
    for last in sorted((one, other)):
        trigger = RenderedTrigger(RenderingSettings(BandSettings(marked=marked)), TriggerTravel(0.05, saturation))
        now_s = 0.0
        for stiffness, touching, step_s in past:
            trigger.render(stiffness, touching, now_s)
            now_s += step_s
        strengths.append(trigger.render(last, contact, now_s).zone_strengths)
    assert all(a <= b for a, b in zip(*strengths, strict=True))


def test_a_change_of_band_is_felt_in_every_reachable_zone() -> None:
    trigger = RenderedTrigger(USUAL, TriggerTravel())
    felt: dict[Band, list[tuple[int, ...]]] = {}
    for step in range(1001):
        effect = trigger.render(step / 1000, None, 0.0)
        felt.setdefault(trigger.band, []).append(effect.zone_strengths)
    assert trigger.band_changes == 2
    for low, high in ((Band.CLEAR, Band.NEAR), (Band.NEAR, Band.DANGER)):
        gained = [b - a for a, b in zip(felt[low][-1], felt[high][0], strict=True)]
        assert min(gained[:8]) >= 1
        assert sum(gained) >= 15


@given(st.floats(0.02, 0.98), st.integers(0, 2**32 - 1))
@REPEATABLE
def test_noise_of_half_a_level_is_not_felt(stiffness: float, seed: int) -> None:
    trigger = RenderedTrigger(USUAL, TriggerTravel())
    noise = np.random.default_rng(seed).uniform(-0.5 / 80, 0.5 / 80, 1000)
    effects = [trigger.render(stiffness + float(n), None, number / 1000) for number, n in enumerate(noise)]
    # A second at 1 kHz: it settles, at most a level and a band away, and then rests.
    changes = [number for number in range(1, 1000) if effects[number] != effects[number - 1]]
    assert len(changes) <= 2


@given(st.floats(0.02, 0.98), st.integers(0, 2**32 - 1))
@REPEATABLE
def test_without_marked_bands_it_is_hardly_felt(stiffness: float, seed: int) -> None:
    trigger = RenderedTrigger(RenderingSettings(BandSettings(marked=False)), TriggerTravel())
    noise = np.random.default_rng(seed).uniform(-0.5 / 80, 0.5 / 80, 1000)
    effects = [trigger.render(stiffness + float(n), None, number / 1000) for number, n in enumerate(noise)]
    # Its two ends lie within 1 % of a level of where the level changes.
    assert sum(a != b for a, b in itertools.pairwise(effects)) <= 20


@pytest.mark.parametrize(
    ("contact", "saturation", "zone"), [(0.0, 0.98, 0), (0.5, 0.98, 3), (1.0, 0.98, 7), (1.0, 0.5, 3), (0.4, 0.5, 1)]
)
def test_contact_is_felt_where_the_finger_meets_it(contact: float, saturation: float, zone: int) -> None:
    trigger = RenderedTrigger(USUAL, TriggerTravel(0.05, saturation))
    plain = RenderedTrigger(USUAL, TriggerTravel(0.05, saturation)).render(0.3, None, 0.0).zone_strengths
    bumped = trigger.render(0.3, contact, 0.0).zone_strengths
    assert [b - a for a, b in zip(plain, bumped, strict=True)] == [2 * (number == zone) for number in range(10)]


def test_the_bump_can_be_turned_off() -> None:
    trigger = RenderedTrigger(RenderingSettings(detent=False), TriggerTravel())
    assert trigger.render(0.0, 0.5, 0.0) == Off()


def test_force_that_lasts_is_eased_but_still_more_than_near() -> None:
    trigger = RenderedTrigger(USUAL, TriggerTravel())
    for tick in range(2001):
        effect = trigger.render(1.0, None, tick / 100)
    assert trigger.limited
    assert trigger.status() == "danger (eased)"
    assert sum(effect.zone_strengths) == 50
    assert trigger.summary()["limited_s"] == pytest.approx(10.0, abs=0.3)
    near = RenderedTrigger(USUAL, TriggerTravel()).render(0.59, None, 0.0)
    assert sum(near.zone_strengths) == 40


def test_reach_follows_from_the_calibration() -> None:
    rendering = TriggerRendering(USUAL, TravelCalibration(r2=TriggerTravel(0.05, 0.7)))
    assert rendering.summary()["l2"] == {
        "reachable_zones": 8,
        "distinct_levels": 65,
        "band_changes": 0,
        "limited_s": 0.0,
    }
    assert rendering.summary()["r2"]["reachable_zones"] == 6
    r2 = rendering.render(update(r2=0.05), 0.0).r2
    assert r2 is not None
    assert r2.zone_strengths == (0, 0, 0, 0, 1, 1, 0, 0, 0, 0)  # the deep end of what a full pull reaches


def test_each_trigger_gets_its_own() -> None:
    rendering = TriggerRendering(USUAL, TravelCalibration())
    wanted = rendering.render(update(l2=0.1, r2_contact=1.0, rumble=0.51), 1.0)
    assert wanted.l2 not in (None, Off())
    assert wanted.r2 == MultiPositionFeedback((0, 0, 0, 0, 0, 0, 0, 2, 0, 0))
    assert wanted.rumble == Rumble(left=0.5)
    assert rendering.render(update(rumble=0.5625 - 1e-4), 1.0).rumble == Rumble(left=0.5)
    assert rendering.render(update(rumble=0.5625 + 1e-4), 1.0).rumble == Rumble(left=0.5)
    assert rendering.render(None, 1.0) == RELEASED
    assert rendering.render(update(rumble=0.0625), 1.0) == RELEASED


def test_with_swapped_sides_each_gets_the_others() -> None:
    calibration = TravelCalibration(l2=TriggerTravel(0.05, 0.5))
    felt = update(l2=0.1, r2=0.3, r2_contact=1.0)
    wanted = TriggerRendering(USUAL, calibration, swap_sides=True).render(felt, 1.0)
    plain = RenderedTrigger(USUAL, calibration.l2).render(0.3, 1.0, 1.0)
    assert wanted.l2 == plain
    assert wanted.r2 == RenderedTrigger(USUAL, calibration.r2).render(0.1, None, 1.0)


@given(st.floats(0.0, 1.0), st.integers(0, 2**32 - 1))
@REPEATABLE
def test_noise_of_half_a_step_does_not_shake_the_motors(rumble: float, seed: int) -> None:
    selector = RumbleSelector()
    noise = np.random.default_rng(seed).uniform(-0.5 / 8, 0.5 / 8, 1000)
    drives = [selector.select(min(max(rumble + float(n), 1e-6), 1.0)).left for n in noise]
    # It settles, at most a step away from where it began to, and then rests.
    assert sum(a != b for a, b in itertools.pairwise(drives)) <= 2


@given(st.lists(STIFFNESS, min_size=1), STIFFNESS)
@REPEATABLE
def test_after_any_past_the_motors_are_within_a_step_and_never_fall_as_danger_grows(
    past: list[float], other: float
) -> None:
    one, two = RumbleSelector(), RumbleSelector()
    for rumble in past[:-1]:
        one.select(rumble)
        two.select(rumble)
    low, high = sorted((past[-1], other))
    left = one.select(low).left, two.select(high).left
    assert left[0] <= left[1]
    assert abs(left[0] - low) < 1 / 8
    assert one.select(0.0) == Rumble()
    assert two.select(1.0) == Rumble(left=1.0)


@pytest.mark.parametrize("stiffness", [-0.1, 1.1, math.nan])
def test_what_is_no_stiffness(stiffness: float) -> None:
    with pytest.raises(ValueError, match="stiffness"):
        RenderedTrigger(USUAL, TriggerTravel()).render(stiffness, None, 0.0)


def test_danger_that_lasts_never_feels_weaker_than_near() -> None:
    with pytest.raises(ValueError, match=r"sustainable_strength = 2 with bands\.danger = 0\.6; valid: above 4"):
        RenderingSettings(sustained=SustainedForceSettings(full_strength=3, sustainable_strength=2))
    RenderingSettings(
        bands=BandSettings(marked=False), sustained=SustainedForceSettings(full_strength=3, sustainable_strength=2)
    )


def test_the_least_danger_is_eased_too_when_it_lasts() -> None:
    trigger = RenderedTrigger(RenderingSettings(), TriggerTravel())
    felt = [max(trigger.render(0.62, None, 0.1 * turn).zone_strengths[:8]) for turn in range(300)]
    assert (felt[0], felt[-1]) == (6, 5)
