"""Frames of objects that are given as differences from an earlier frame equal whole frames."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.roles import Role
from robot_side.surroundings.movers import OF_OBJECTS, Movers
from robot_side.surroundings.perceived import KINDS, PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from tests.helpers.perceived_scenes import random_rotation, random_scene


def whole(rng: np.random.Generator) -> PerceivedObjects:
    objects = random_scene(rng, 3, meshes=2)
    count = len(objects.names)
    return replace(
        objects,
        positions_m=rng.normal(size=(count, 3)),
        rotations=np.array([random_rotation(rng) for _ in range(count)]),
        velocities_m_s=rng.normal(size=(count, 3)),
    )


def elsewhere(objects: PerceivedObjects, things: np.ndarray, rng: np.random.Generator) -> PerceivedObjects:
    changed = {}
    for kind in KINDS:
        mine = np.isin(getattr(objects, kind.owner), things)
        for name in kind.fields:
            values = getattr(objects, name).copy()
            values[mine] = rng.normal(size=values[mine].shape)
            changed[name] = values
    for name in OF_OBJECTS:
        values = getattr(objects, name).copy()
        values[things] = rng.normal(size=values[things].shape)
        changed[name] = values
    return replace(objects, **changed)


@settings(derandomize=True, deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), share=st.sampled_from([0.0, 0.3, 1.0]))
def test_such_a_frame_is_the_whole_frame(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    first = whole(rng)
    things = np.flatnonzero(rng.uniform(size=len(first.names)) < share)
    movers, expected = Movers(first, things), elsewhere(first, things, rng)
    roles = (Role.TARGET, *first.roles[1:])
    found = movers.frame(3.0, movers.numbers_in(expected), roles)
    assert (found.time_s, found.roles, found.names) == (3.0, roles, first.names)
    seeing = Surroundings()
    assert seeing.target(found) == 0
    assert seeing.target(first) is None
    # No array was built yet.
    assert not {name for kind in KINDS for name in kind.fields} & set(vars(found))
    for one in (found, replace(found, time_s=4.0)):
        for field in fields(PerceivedObjects):
            value = getattr(expected, field.name)
            if isinstance(value, np.ndarray):
                np.testing.assert_array_equal(getattr(one, field.name), value, err_msg=field.name)
                assert getattr(one, field.name).flags.c_contiguous
    assert replace(found, time_s=4.0).since is None


def test_figures_unknown_for_some_objects_are_unknown_for_all() -> None:
    first = replace(whole(np.random.default_rng(1)), velocities_m_s=None)
    movers = Movers(first, np.array([0, 4]))
    assert movers.frame(0.0, movers.at_first, first.roles).velocities_m_s is None


def test_other_objects_than_the_movers_are_refused() -> None:
    first = whole(np.random.default_rng(2))
    movers = Movers(first, np.array([0, 1, 4]))
    with pytest.raises(
        ValueError, match=r"numbers is float64 in the shape \(1, 20\); valid: contiguous float64 in the shape"
    ):
        movers.frame(0.0, movers.at_first[:1], first.roles)
    with pytest.raises(ValueError, match=r"roles holds 0 roles; valid: one for each"):
        movers.frame(0.0, movers.at_first, ())
    for things in ([4, 0], [0, 0], [-1], [len(first.names)]):
        with pytest.raises(ValueError, match="rising indices"):
            Movers(first, np.array(things))
    with pytest.raises(ValueError, match="complete frame"):
        Movers(movers.frame(0.0, movers.at_first, first.roles), np.array([0]))
