"""A field that is as stiff as it is told, for whoever has no arm."""

import pytest

from common.protocol.uniform_field import FAR_M, STRENGTHS, uniform_field


@pytest.mark.parametrize("strength", range(STRENGTHS + 1))
def test_so_many_ways_begin_before_any_distance(strength: int) -> None:
    field = uniform_field(strength)
    for ways in (field.fast_m, field.slow_m):
        assert sum(way <= -FAR_M for way in ways) == strength
        assert sum(way >= FAR_M for way in ways) == STRENGTHS - strength
    assert field.stiffness == strength / STRENGTHS


@pytest.mark.parametrize("strength", [-1, 9])
def test_there_are_eight_strengths(strength: int) -> None:
    with pytest.raises(ValueError, match=f"strength = {strength}; valid: 0 to 8"):
        uniform_field(strength)
