"""81 profiles that only ever grow, and what of them a finger can feel."""

import itertools

import pytest

from operator_side.dualsense.effects.official import MultiPositionFeedback, Off
from operator_side.feel.force_profiles import MAX_LEVEL, ForceProfiles, force_profiles

REACHABLE = range(1, 11)


@pytest.mark.parametrize("zones", REACHABLE)
def test_every_level_adds_one_strength_to_one_zone(zones: int) -> None:
    effects = ForceProfiles(zones).effects
    assert effects[0] == Off()
    assert effects[MAX_LEVEL] == MultiPositionFeedback((8,) * 10)
    for lower, higher in itertools.pairwise(effects):
        gained = [b - a for a, b in zip(lower.zone_strengths, higher.zone_strengths, strict=True)]
        assert sorted(gained) == [0] * 9 + [1]


@pytest.mark.parametrize("zones", REACHABLE)
def test_reachable_zones_fill_first_and_without_a_step_down(zones: int) -> None:
    for effect in ForceProfiles(zones).effects:
        within, beyond = effect.zone_strengths[:zones], effect.zone_strengths[zones:]
        assert list(within) == sorted(within)
        assert within[-1] - within[0] <= 1
        # The zones beyond catch up only once every reachable zone has had its turn, in their order.
        assert list(beyond) == sorted(beyond, reverse=True)
        assert all(within[0] >= strength for strength in beyond)


@pytest.mark.parametrize("zones", REACHABLE)
def test_levels_that_feel_alike_are_reported(zones: int) -> None:
    profiles = ForceProfiles(zones)
    shapes = [profiles.felt(level) for level in range(MAX_LEVEL + 1)]
    assert profiles.distinct_levels == len(set(shapes)) == 8 * zones + 1
    for run in profiles.felt_alike:
        assert len({shapes[level] for level in run}) == 1
        assert list(run) == list(range(run[0], run[-1] + 1))
    alike = {level for run in profiles.felt_alike for level in run}
    alone = [level for level in range(MAX_LEVEL + 1) if shapes.count(shapes[level]) == 1]
    assert alike.isdisjoint(alone)
    assert len(alike) + len(alone) == MAX_LEVEL + 1


def test_with_every_zone_reachable_all_81_levels_differ() -> None:
    assert ForceProfiles(10).felt_alike == ()
    assert ForceProfiles(8).felt_alike[0] == (8, 9, 10)


@pytest.mark.parametrize("zones", [0, 11, -1])
def test_impossible_reach(zones: int) -> None:
    with pytest.raises(ValueError, match="reachable_zones"):
        force_profiles(zones)
