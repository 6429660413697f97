"""Both sides in virtual time, from a scripted person's fingers to a lifted target and back as stiffness."""

import functools
import itertools
from typing import Any

import pytest

from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from operator_side.settings import OperatorSettings
from operator_side.simulated_person.person import SimulatedOperator
from robot_side.settings import RobotSettings

pytestmark = pytest.mark.long


def loopback(link: str, *, haptics: bool = True, seed: int = 0) -> Loopback:
    return Loopback(
        LoopbackSettings(RobotSettings(link=link, seed=seed), OperatorSettings(link=link, haptics=haptics, seed=seed))
    )


episodes = pytest.mark.xdist_group("episodes")
"""Runs by one worker, so that each episode is played once."""


@functools.cache
def episode(delay_ms: int, *, haptics: bool) -> dict[str, Any]:
    run = loopback(f"delay {delay_ms}ms 10ms distribution normal" if delay_ms else "", haptics=haptics)
    # By then the target is lifted, or without haptics, where only the way there counts, approached.
    run.run_until((11.0 if delay_ms else 8.5) if haptics else 4.5)
    return run.summary()


@episodes
@pytest.mark.parametrize("delay_ms", [0, 200])
def test_the_target_is_reached_grasped_and_lifted(delay_ms: int) -> None:
    summary = episode(delay_ms, haptics=True)
    assert summary["task"]["time_to_grasp_s"] is not None
    assert summary["task"]["lifted_mm"] > 50.0
    assert summary["task"]["contacts_by_object"]["target"] >= 1
    assert summary["stops"] == []
    assert summary["errors"] == []
    assert summary["messages"]["rejected"] == 0


@episodes
def test_what_is_ahead_is_felt_on_the_advancing_trigger_alone() -> None:
    stiffness = episode(200, haptics=True)["stiffness"]
    assert stiffness["r2"]["max"] > 0.3
    assert stiffness["l2"]["max"] < 0.3


def test_a_bump_where_contact_begins_comes_to_meet_the_finger() -> None:
    run = loopback("")
    contacts: list[float] = []
    bumps = set()
    person = run.person
    assert isinstance(person, SimulatedOperator)
    while person.phase != "close" and run.clock.now() < 9.0:
        run.run_until(run.clock.now() + 0.05)
        felt = run.operator.stiffness
        assert felt is None or felt.l2_contact is None
        if felt is not None and felt.r2_contact is not None:
            contacts.append(felt.r2_contact)
            r2 = run.device.effects[1].zone_strengths
            bumps.add(max(range(10), key=lambda zone: r2[zone]))
    assert contacts[0] > 0.5
    assert contacts[-1] < 0.05
    assert all(later <= earlier + 0.02 for earlier, later in itertools.pairwise(contacts))
    assert len(bumps) >= 4


@episodes
def test_a_person_whose_left_hand_advances_gets_there_as_well() -> None:
    operator = OperatorSettings(swap_sides=True)
    run = Loopback(LoopbackSettings(RobotSettings(), operator))
    run.run_until(6.5)
    assert run.summary()["task"]["time_to_grasp_s"] == episode(0, haptics=True)["task"]["time_to_grasp_s"]


def test_more_delay_means_more_enlargement() -> None:
    moving = [episode(delay_ms, haptics=False)["enlargement_mm"]["mean_moving"] for delay_ms in (0, 50, 200)]
    assert moving[0] < moving[1] < moving[2]


@episodes
@pytest.mark.parametrize("delay_ms", [0, 200])
def test_each_direction_measures_the_delay_that_was_asked_for(delay_ms: int) -> None:
    summary = episode(delay_ms, haptics=True)
    spread_ms = 10.0 if delay_ms else 0.0
    for direction in ("to_robot", "to_operator"):
        assert summary["delay_ms"][direction]["mean"] == pytest.approx(delay_ms, abs=0.6)
        assert summary["delay_ms"][direction]["sd"] == pytest.approx(spread_ms, abs=0.6)
    # Latest wins: what is applied is the quicker part of what arrives.
    if delay_ms:
        assert summary["applied_age_ms"]["to_operator"]["mean"] < summary["delay_ms"]["to_operator"]["mean"]


@episodes
def test_nothing_is_lost_on_a_link_without_loss() -> None:
    messages = episode(0, haptics=True)["messages"]
    assert messages["stiffness_sent"] == messages["stiffness_received"]
    assert messages["motion_sent"] == messages["motion_received"]
    assert messages["stale"] == 0


def without_times(summary: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in summary.items() if key != "tick_us"}


def test_the_same_seed_gives_the_same_numbers() -> None:
    def run(seed: int) -> dict[str, Any]:
        both = loopback("delay 30ms 10ms", seed=seed)
        both.run_until(3.0)
        return without_times(both.summary())

    first = run(7)
    assert run(7) == first
    assert run(8) != first


def test_time_may_pass_in_any_steps() -> None:
    whole, pieces = loopback("delay 20ms 5ms"), loopback("delay 20ms 5ms")
    whole.run_until(2.0)
    for milliseconds in range(0, 2001, 13):
        pieces.run_until(milliseconds / 1000)
    pieces.run_until(2.0)
    assert without_times(whole.summary()) == without_times(pieces.summary())


def test_triggers_are_released_when_the_robot_side_goes_silent() -> None:
    both = loopback("")
    both.run_until(1.0)
    while both.device.released and both.clock.now() < 8.0:
        both.run_until(both.clock.now() + 0.01)
    assert not both.device.released
    # From here on the robot side is gone: the operator side's own clock has to notice.
    now_s = both.clock.now()
    for milliseconds in range(1, 203):
        output = both.operator.output_report(now_s + milliseconds / 1000)
        if output is not None:
            both.device.write(output, now_s + milliseconds / 1000)
    assert both.device.released
