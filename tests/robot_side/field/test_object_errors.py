"""Each object's own error in the enlargement, and groups of objects that are enlarged alike."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.roles import Role
from robot_side.enlargement.distance import Uncertainty
from robot_side.field.object_class import OBSTACLE, SKIPPED
from robot_side.field.object_errors import alike, largest_errors, object_errors
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, along, ball_pose, look
from tests.helpers.field.situations import CAMERA_SD_M, uncertain
from tests.helpers.perceived_scenes import Scene

QUANTILE = Uncertainty(0.99).quantile
spreads_m = st.floats(0.0, 0.03)


def two_blocks(**said: Any) -> PerceivedObjects:
    """Return a block on the gripper's path at 60 mm, and one at 80 mm."""
    scene = Scene()
    for at_m in (0.06, 0.08):
        scene.add().box([0.0, 0.0, at_m + 0.05], [0.2, 0.2, 0.05])
    return replace(scene.objects(), **said)


def first_m(objects: PerceivedObjects, own: FloatArray | None, **changes: Any) -> float:
    """Return the onset distance of full strength, ahead of one sphere."""
    known = uncertain()
    unseen_m, variance_m2 = largest_errors(own, known)
    looked = replace(along(AHEAD, variance_m2=variance_m2, quantile=known.quantile), unseen_m=unseen_m, of_objects=own)
    return float(look(ball_pose(), objects, replace(looked, **changes)).fast_m[-1])


def test_an_object_without_an_error_of_its_own_has_the_settings() -> None:
    known = uncertain()
    assert object_errors(two_blocks(), known) is None
    assert largest_errors(None, known) == (0.0, CAMERA_SD_M**2)
    own = object_errors(two_blocks(sds_m=np.array([np.nan, 0.0]), unseen_m=0.002), known)
    np.testing.assert_array_equal(own, [[0.002, CAMERA_SD_M**2], [0.002, 0.0]])
    velocities = np.array([[0.0, 0.3, 0.4], [0.0, 0.0, 0.0]])
    own = object_errors(two_blocks(velocities_m_s=velocities, late_s=0.02), known)
    assert own is not None
    np.testing.assert_allclose(own[:, 0], [0.01, 0.0])


def test_the_less_certain_block_stiffens_first_though_it_is_farther() -> None:
    objects = two_blocks(sds_m=np.array([0.0, 0.015]))
    own = object_errors(objects, uncertain())
    near_m, far_m = first_m(objects, None), first_m(objects, own)
    assert far_m == pytest.approx(near_m + 0.02 + QUANTILE * (CAMERA_SD_M - 0.015), abs=1e-4)


@settings(derandomize=True, deadline=None, max_examples=30)
@given(near_m=spreads_m, far_m=spreads_m, unseen_m=st.floats(0.0, 0.02))
def test_the_onset_is_the_least_of_those_to_each_object_alone(near_m: float, far_m: float, unseen_m: float) -> None:
    both = object_errors(two_blocks(sds_m=np.array([near_m, far_m]), unseen_m=unseen_m), uncertain())
    assert both is not None
    alone_m = []
    for kept in (0, 1):
        roles = tuple(Role.OBSTACLE if thing == kept else Role.IGNORED for thing in (0, 1))
        unseen, variance = both[kept]
        alone_m.append(first_m(two_blocks(roles=roles), None, unseen_m=unseen, variance_m2=variance))
    assert first_m(two_blocks(), both) == pytest.approx(min(alone_m), abs=1e-4)


@settings(derandomize=True, deadline=None, max_examples=20)
@given(sd_m=spreads_m, unseen_m=st.floats(0.0, 0.02))
def test_equal_errors_of_all_give_the_same_bits_as_one_for_all(sd_m: float, unseen_m: float) -> None:
    objects = two_blocks()
    one = first_m(objects, None, unseen_m=unseen_m, variance_m2=sd_m**2)
    assert first_m(objects, np.array([[unseen_m, sd_m**2]] * 2)) == one


@settings(derandomize=True, deadline=None)
@given(
    sds_m=st.lists(st.sampled_from([0.0, 0.001, 0.002, 0.01]) | spreads_m, min_size=1, max_size=60),
    skipped=st.integers(0, 3),
    p=st.floats(0.01, 0.99),
)
def test_groups_hold_each_felt_object_once_and_enlarge_none_too_little(
    sds_m: list[float], skipped: int, p: float
) -> None:
    known, count = uncertain(probability=p), len(sds_m)
    own = np.stack([np.linspace(0.0, 0.01, count), np.square(sds_m)], axis=1)
    classes = np.full(count, OBSTACLE)
    classes[:skipped] = SKIPPED
    groups = alike(own, classes, known)
    assert len(groups) <= 16
    shown = np.stack([group.classes != SKIPPED for group in groups])
    np.testing.assert_array_equal(shown.sum(axis=0), classes != SKIPPED)
    for unseen_m, variance_m2, some in groups:
        for thing in np.flatnonzero(some != SKIPPED):
            enlarged_m = unseen_m + known.quantile * np.sqrt(variance_m2)
            assert enlarged_m >= own[thing, 0] + known.quantile * np.sqrt(own[thing, 1])
