"""Approaches whose outcomes can be computed by hand, and the criteria for outcomes."""

import functools
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from feelahead.lab.approaches.approach import Approach, run_approach
from feelahead.lab.approaches.frozen import ASIDE
from feelahead.lab.approaches.outcome import SAMPLE_S, Outcome, Trace, reversals, stands
from tests.helpers.repository import DATA

pytestmark = pytest.mark.long

approaches = pytest.mark.xdist_group("approaches")
"""Mark that runs these tests in one worker of pytest-xdist, so that each approach is computed once."""
WAY_MM = 320.0
FAR = "delay 200ms"
JITTER = "delay 20ms 10ms distribution normal"


@functools.cache
def ended(scene: str = "wall", force_n: float = 3.0, **changes: Any) -> Outcome:
    return run_approach(Approach(DATA / f"{scene}.xml", force_n, **changes))


def free_speed_mm_s(force_n: float) -> float:
    """Return the commanded speed of a finger that pulls a free trigger with `force_n`: calibrated travel x 250 mm/s."""
    sensed = min((force_n - 0.5) / 4.0 / 0.75, 1.0)
    return 250.0 * min((sensed - 0.05) / (0.98 - 0.05), 1.0)


# Onto a wall


@approaches
@pytest.mark.parametrize(("force_n", "known_mm_s", "link"), [(3.0, 210.0, ""), (3.0, 210.0, FAR), (2.0, 120.0, FAR)])
def test_without_haptics_a_wall_is_hit_unbraked(force_n: float, known_mm_s: float, link: str) -> None:
    outcome = ended(force_n=force_n, link=link, law="none")
    assert (outcome.end, outcome.contact_with) == ("contact", "wall")
    assert outcome.contact_speed_mm_s == pytest.approx(known_mm_s, abs=3.0)
    assert outcome.contact_speed_mm_s == pytest.approx(free_speed_mm_s(force_n), abs=3.0)
    assert (outcome.stops_at_mm, outcome.way_left_mm, outcome.reversals) == (None, None, 0)


@approaches
@pytest.mark.parametrize("link", ["", f"{FAR} 10ms distribution normal"])
def test_a_light_finger_stops_before_the_wall_whatever_the_delay(link: str) -> None:
    outcome = ended(force_n=2.0, link=link)
    assert (outcome.end, outcome.contact_speed_mm_s, outcome.contact_with) == ("stopped", None, None)
    assert outcome.stops_at_mm is not None
    assert 10.0 < outcome.stops_at_mm < 20.0
    assert outcome.way_left_mm == pytest.approx(outcome.stops_at_mm, abs=0.01)
    # It stops where it is nearest, and has slowed down once.
    assert outcome.least_gap_mm == pytest.approx(outcome.stops_at_mm, abs=0.1)
    assert outcome.reversals == 1
    assert 1e3 * outcome.trace.speed_m_s.max() == pytest.approx(free_speed_mm_s(2.0), abs=3.0)


@approaches
@pytest.mark.parametrize("link", ["", FAR])
def test_a_finger_that_overcomes_the_effect_touches_slowly_whatever_the_delay(link: str) -> None:
    outcome = ended(link=link)
    assert (outcome.end, outcome.contact_with) == ("contact", "wall")
    assert outcome.contact_speed_mm_s is not None
    assert 0.0 < outcome.contact_speed_mm_s <= 40.0
    # 1 N is left of its force.
    assert outcome.contact_speed_mm_s == pytest.approx(free_speed_mm_s(1.0), abs=3.0)
    assert outcome.reversals == 1


@approaches
def test_what_is_gripped_counts_as_gripper() -> None:
    outcome = ended("place_held", force_n=3.7, grip=True, law="none")
    assert (outcome.end, outcome.contact_with) == ("contact", "table")
    assert outcome.contact_speed_mm_s == pytest.approx(250.0, abs=3.0)
    assert 1e3 * outcome.trace.gap_m[0] == pytest.approx(WAY_MM, abs=1.0)


# Objects beside a straight pull, moving away, or rising


@approaches
@pytest.mark.parametrize(
    ("scene", "thing", "link", "stops_in_s"),
    [
        ("edge", "right_block", "", 4.0),
        ("turn", "right_post", "", 4.5),
        ("fleeing", "mover", "", 8.0),
        ("terrain_ahead", "terrain", FAR, 4.5),
    ],
)
def test_a_light_finger_stops_and_a_strong_one_touches_slowly_on_every_path(
    scene: str, thing: str, link: str, stops_in_s: float
) -> None:
    stick, turn = ASIDE.get(scene, ((0.0, 0.0), (0.0, 0.0)))
    light, strong = (
        ended(scene, force_n, stick=stick, turn=turn, link=link, duration_s=stops_in_s) for force_n in (2.0, 3.0)
    )
    assert (light.end, light.contact_with) == ("stopped", None)
    assert 5.0 < light.least_gap_mm < 25.0
    assert (strong.end, strong.contact_with) == ("contact", thing)
    assert strong.contact_speed_mm_s is not None
    assert strong.contact_speed_mm_s <= 40.0


# Reproducibility


def numbers(outcome: Outcome) -> dict[str, Any]:
    plain = {one.name: getattr(outcome, one.name) for one in fields(Outcome) if one.name != "trace"}
    return plain | {one.name: getattr(outcome.trace, one.name).tolist() for one in fields(Trace)}


@approaches
def test_a_seed_gives_the_same_outcome_whatever_ran_before_and_another_one_another() -> None:
    asked = Approach(DATA / "wall.xml", 3.7, duration_s=0.5, link=JITTER)
    first = numbers(run_approach(asked))
    assert first["end"] == "undecided"
    assert first["contact_speed_mm_s"] is first["stops_at_mm"] is first["way_left_mm"] is None
    assert numbers(run_approach(replace(asked, seed=1))) != first
    assert numbers(run_approach(asked)) == first


# Impossible runs


def test_a_robot_that_is_not_armed_fails_with_the_link_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("feelahead.both_sides.episode.LONGEST_ARMING_S", 3.0)
    for changes, why in (
        ({"link": "loss 100%"}, "not armed within 3 s over --link 'loss 100%'"),
        ({"grip": True}, "grip"),
    ):
        failed = ended(**changes)
        assert failed.end == "failed"
        assert failed.why is not None
        assert why in failed.why
        assert failed.contact_speed_mm_s is failed.stops_at_mm is None


def test_an_arm_that_safety_stops_has_not_been_stopped_by_the_law() -> None:
    stopped = ended(link="outage 300ms at 2.3s", duration_s=3.0)
    assert (stopped.end, stopped.stops_at_mm) == ("disarmed", None)
    assert stopped.why is not None
    assert "no command for" in stopped.why


# Reversals


@pytest.mark.parametrize(
    ("speeds_mm_s", "count"),
    [
        ([], 0),
        ([0, 50, 100, 200, 210], 0),  # monotone
        ([0, 100, 200, 200, 100, 0], 1),  # rises and stops
        ([0, 200, 0, 200, 0, 200, 0], 5),
        ([100, 86, 100, 86, 100], 0),  # Noise.
        ([100, 84, 100, 84, 100], 4),
        ([0, 100, 95, 90, 85, 80], 1),  # little by little
    ],
)
def test_reversals_are_swings_of_more_than_15_mm_s(speeds_mm_s: list[float], count: int) -> None:
    assert reversals([1e-3 * one for one in speeds_mm_s]) == count


# Standing still


@pytest.mark.parametrize(
    ("last_m_s", "standing"),
    [
        ([0.00099] * 102, True),
        ([-0.0011] * 102, False),
        ([0.0] * 90, False),  # Too short.
        ([0.002, *[0.0] * 94], False),  # One twitch.
    ],
)
def test_the_gripper_stands_when_it_has_been_slow_for_a_second(last_m_s: list[float], *, standing: bool) -> None:
    speeds_m_s = [0.2] * 100 + last_m_s
    rows = len(speeds_m_s)
    times_s, still = np.linspace(0.0, SAMPLE_S * (rows - 1), rows), np.zeros(rows)
    trace = Trace(times_s, np.array(speeds_m_s), still, still, np.zeros((rows, 10), dtype=np.int64))
    assert stands(trace) is standing
