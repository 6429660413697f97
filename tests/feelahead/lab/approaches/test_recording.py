"""Recorded approaches: what each side knew, how the arm moved, and how it would move after a release."""

import functools

import numpy as np
import pytest

from common.reaction import HORIZON_S
from feelahead.lab.approaches.evaluation import LINKS
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.pulls import PullKind
from feelahead.lab.approaches.recording import POSE_S, TICK_S, RecordedApproach, record_approach
from feelahead.lab.approaches.replay import Replay
from feelahead.lab.approaches.stopping_path import stopping_path
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.settings import EncoderSettings

pytestmark = pytest.mark.long

recordings = pytest.mark.xdist_group("recordings")
"""Mark that runs these tests in one worker of pytest-xdist, so that each pull is recorded once."""
DELAY_S, DURATION_S = 0.05, 2.0
SEED = 1
"""Seed that draws a fast steady pull, as the tests check."""


@functools.cache
def recorded() -> RecordedApproach:
    return record_approach("steady", f"delay {1e3 * DELAY_S:g}ms", SEED, DURATION_S, "wall")


@recordings
def test_what_was_sent_arrives_one_delay_later() -> None:
    one = recorded()
    applied = ~np.isnan(one.applied_sent_s)
    assert applied[one.tick_row(one.began_s) :].all()
    np.testing.assert_allclose((one.applied_at_s - one.applied_sent_s)[applied], DELAY_S, atol=TICK_S + 1e-9)
    assert (np.diff(one.applied_sent_s[applied]) >= 0.0).all()
    assert (one.applied_at_s[applied] <= one.tick_time_s[applied]).all()
    # Each command, one every 4 ms, is followed until the next one.
    followed_s = (one.tick_time_s - one.applied_sent_s)[applied]
    assert followed_s.min() >= DELAY_S - 1e-9
    assert followed_s.max() < DELAY_S + 0.004 + TICK_S
    seen_s = (one.tick_time_s - one.seen_sent_s)[~np.isnan(one.seen_sent_s)]
    assert len(seen_s) > 700
    assert seen_s.min() >= DELAY_S - 1e-9
    # Stiffness comes with each tick, or every few of them.
    assert seen_s.max() < DELAY_S + 0.01


# From a moment until the arm stops

STARTS_S, GOES_S = 0.02, 0.8
"""Times in a pull over a link of 200 ms, in seconds: the first command arrives; the arm moves at constant speed."""


@functools.cache
def replayed(pull: PullKind) -> Replay:
    record = record_approach(pull, LINKS["200 ms"], SEED, duration_s=2.0)
    return Replay(record, load_scene(frozen_scene("empty"), SITE), EncoderSettings(), SEED)


def commanded_m_s(replay: Replay) -> float:
    return replay.motion.trigger_speed_m_s * float(replay.record.command[-1])


@recordings
def test_an_arm_that_goes_brakes_from_the_zones_speed_and_one_that_starts_has_to_reach_it_first() -> None:
    replay, ends_m = replayed("steady"), []
    speed_m_s = commanded_m_s(replay)
    for since_s in (0.0, GOES_S):
        time_s = replay.record.began_s + since_s
        arrives_s = replay.record.arrives_s(time_s)
        times_s, path = stopping_path(replay, time_s, speed_m_s)
        assert np.diff(times_s).max() < POSE_S + 1e-9
        np.testing.assert_array_equal(path.positions_m[0], replay.pose_at(time_s).tool_position_m)
        reached_m = replay.pose_at(arrives_s).tool_position_m
        ends_m.append(float((path.positions_m[-1] - reached_m) @ replay.axis) - speed_m_s * HORIZON_S)
    starts_m, goes_m = ends_m
    # At 3 m/s²: u²/2a more than u h, or, from rest, just u h.
    assert goes_m == pytest.approx(speed_m_s**2 / 6.0, rel=0.2)
    assert starts_m == pytest.approx(0.0, abs=0.001)


@recordings
@pytest.mark.parametrize(("pull", "direction", "fastest"), [("drift", 0, 0.1), ("yaw", 4, 0.5)])
def test_sticks_end_go_on_by_half_or_go_on_until_it_stands(pull: PullKind, direction: int, fastest: float) -> None:
    replay = replayed(pull)
    began_s = replay.record.began_s
    assert replay.moves_sticks(began_s - 0.1, began_s + 0.01)
    assert not replay.moves_sticks(began_s + 0.01, began_s + 1.0)
    assert not replay.sticks_at(began_s - 0.1).any()
    # So early no part of the arm has moved, and no report could show it.
    time_s = began_s + STARTS_S
    assert np.abs(replay.sticks_at(time_s)) == pytest.approx(fastest * np.eye(6)[direction], abs=1e-3)
    side, aside = np.sign(replay.sticks_at(time_s)[direction]), []
    for share in (0.0, 0.5, 1.0):
        since_s, path = stopping_path(replay, time_s, 0.1, share)
        before, after = path.rotations[0], path.rotations[-1]
        goes_m = before.T @ (path.positions_m[-1] - path.positions_m[0])
        aside.append(side * (goes_m[0] if pull == "drift" else np.cross(before[:, 2], after[:, 2]) @ before[:, 1]))
    going_on = fastest * (since_s[-1] - (replay.record.arrives_s(time_s) - time_s))
    # It must start, and the finger may be released earlier than the stick.
    assert 0.0 <= aside[0] < 0.1 * going_on < 0.45 * going_on < aside[1] < 0.6 * going_on
    assert 0.8 * going_on < aside[2] < 1.05 * going_on
