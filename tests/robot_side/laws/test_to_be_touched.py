"""Objects to be touched: a target, or a support while something is held. Slow zones get less strength, and later."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.field.along import Along
from robot_side.field.field import Ahead, Field
from robot_side.field.object_class import OBSTACLE, SKIPPED, TARGET, TOUCHABLE
from robot_side.field.scratch import TOUCH_STRENGTH, Count
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, EQUAL_M, along, ball_pose, look
from tests.helpers.gripper_poses import OPENING_M, free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_scene

MEAN_M, SD_M, QUANTILE = 0.002, 0.003, 2.33
INFLATED_M = MEAN_M + QUANTILE * SD_M
DOUBTFUL = along(AHEAD, MEAN_M, variance_m2=SD_M**2, quantile=QUANTILE)
WALL = Scene().add().box([0.0, 0.0, 0.15], [0.2, 0.2, 0.05]).objects()
seeds = st.integers(0, 2**32 - 1)


def one(object_class: int, objects: PerceivedObjects = WALL, looked: Along = DOUBTFUL) -> Field:
    return look(ball_pose(), objects, looked, classes=[object_class])


def test_an_obstacle_is_the_same_in_both_lists() -> None:
    found = one(OBSTACLE)
    np.testing.assert_array_equal(found.slow_m, found.fast_m)


@pytest.mark.parametrize("object_class", [TARGET, TOUCHABLE])
def test_it_is_in_the_fast_list_like_an_obstacle_and_in_the_slow_one_at_most_half_as_strong(object_class: int) -> None:
    obstacle, touched = one(OBSTACLE), one(object_class)
    np.testing.assert_array_equal(touched.fast_m, obstacle.fast_m)
    # At its expected position: the fast onset distance plus D_σ(P) - D_σ(0.5).
    expected = obstacle.fast_m[:TOUCH_STRENGTH] + INFLATED_M - MEAN_M
    np.testing.assert_allclose(touched.slow_m[:TOUCH_STRENGTH], expected, atol=1e-12)
    assert TOUCH_STRENGTH == 4
    assert np.isinf(touched.slow_m[TOUCH_STRENGTH:]).all()


def test_a_mean_below_0_is_no_place_behind_the_surface() -> None:
    nearer = along(AHEAD, -0.004, variance_m2=SD_M**2, quantile=QUANTILE)
    shift = one(TARGET, looked=nearer).slow_m[:4] - one(OBSTACLE, looked=nearer).slow_m[:4]
    np.testing.assert_allclose(shift, QUANTILE * SD_M - 0.004)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=seeds)
def test_toggling_the_target_changes_no_fast_way_and_lengthens_slow_ones_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 2, 0.15)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    looked = along(direction, MEAN_M, variance_m2=SD_M**2, quantile=QUANTILE)
    pose = free_pose(rng.uniform(-0.03, 0.03, (6, 3)), rng.uniform(0.004, 0.02, 6))
    before, after = [OBSTACLE] * len(objects.names), [OBSTACLE] * len(objects.names)
    after[int(rng.integers(len(after)))] = TOUCHABLE
    plain, toggled = (look(pose, objects, looked, classes=classes) for classes in (before, after))
    np.testing.assert_allclose(toggled.fast_m, plain.fast_m, atol=EQUAL_M)
    assert (toggled.slow_m >= plain.slow_m - EQUAL_M).all()
    assert (toggled.slow_m >= toggled.fast_m - EQUAL_M).all()


def test_what_stands_before_or_behind_it_stays_in_the_slow_list() -> None:
    scene = Scene().add().box([0.0, 0.0, 0.08], [0.2, 0.2, 0.005]).add().box([0.0, 0.0, 0.12], [0.2, 0.2, 0.005])
    objects = scene.objects()
    first, last = (
        look(ball_pose(), objects, DOUBTFUL, classes=classes) for classes in ([OBSTACLE, TARGET], [TARGET, OBSTACLE])
    )
    # A target behind an obstacle changes nothing. An obstacle behind a target has full strength at its own distance.
    np.testing.assert_allclose(first.slow_m, first.fast_m, atol=EQUAL_M)
    alone = look(ball_pose(), objects, DOUBTFUL, classes=[SKIPPED, OBSTACLE])
    np.testing.assert_allclose(last.slow_m[4:], alone.slow_m[4:], atol=EQUAL_M)
    assert (last.slow_m[:4] < alone.slow_m[:4]).all()


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=seeds)
def test_both_lists_are_the_least_over_spheres_that_err_differently(seed: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 1, 0.1)
    classes = rng.choice([OBSTACLE, TOUCHABLE, TARGET], len(objects.names)).tolist()
    centers, radii = rng.uniform(-0.2, 0.2, (6, 3)), rng.uniform(0.004, 0.02, 6)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    looked = along(direction, 0.001, variance_m2=1e-6, quantile=QUANTILE, reach_m=0.4)

    def field(chosen: slice) -> Field:
        turning = Ahead(np.array([0.0, 0.0, 0.0, 0.05, 0.05, 0.05]))
        return look(free_pose(centers[chosen], radii[chosen]), objects, looked, classes=classes, by=turning)

    whole, alone = field(slice(None)), [field(slice(k, k + 1)) for k in range(6)]
    np.testing.assert_allclose(whole.fast_m, np.min([one.fast_m for one in alone], axis=0), atol=EQUAL_M)
    np.testing.assert_allclose(whole.slow_m, np.min([one.slow_m for one in alone], axis=0), atol=EQUAL_M)
    assert whole.sigma_m == max(one.sigma_m for one in alone)


def test_a_better_known_sphere_may_touch_first_though_felt_last() -> None:
    """An outer sphere's position may err by 20 mm, as the tool's angle may err. One on the axis is known exactly.

    The sphere on the axis lies 3 mm farther ahead.
    """
    outer, middle = ([0.2, 0.0, 0.0], [0.0, 0.0, 0.003])
    turning = Ahead(np.array([0.0, 0.0, 0.0, 0.0, 0.1 / QUANTILE, 0.0]))
    looked = along(AHEAD, 0.0, quantile=QUANTILE)
    fields = [
        look(free_pose(centers, [0.008] * len(centers)), WALL, looked, classes=[TOUCHABLE], by=turning)
        for centers in ([outer], [middle], [outer, middle])
    ]
    assert fields[0].fast_m[7] < fields[1].fast_m[0]
    assert fields[1].slow_m[3] < fields[0].slow_m[3]
    np.testing.assert_allclose(fields[2].fast_m, fields[0].fast_m, atol=EQUAL_M)
    np.testing.assert_allclose(fields[2].slow_m, fields[1].slow_m, atol=EQUAL_M)


# Between the fingers (§3.4)


def fingers_about(object_class: int, widest_m: float, inflated_m: float = 0.02) -> Field:
    """Return the field towards a block for two fingertips that will pass it on both sides, and a palm behind them."""
    pose = free_pose([[0.03, 0.0, 0.0], [-0.03, 0.0, 0.0], [0.0, 0.0, -0.1]], [0.008] * 3, [True, True, False])
    block = Scene().add().box([0.0, 0.0, 0.05], [0.015, 0.02, 0.02]).objects()
    return look(pose, block, along(AHEAD, inflated_m), classes=[object_class], widest_m=widest_m)


def test_towards_the_target_a_finger_is_enlarged_by_at_most_half_the_gap_and_that_is_counted() -> None:
    free = fingers_about(TARGET, np.inf)
    assert free.counts[Count.LIMITED] == 0
    limited = fingers_about(TARGET, 0.004)
    assert limited.counts[Count.LIMITED] == 2
    # The fingers pass the block, 7 mm to each side. Only the palm meets it, with its full inflation.
    assert free.fast_m[0] < 0.0 < limited.fast_m[0]
    face_m = 0.03 + 0.1 - 0.008 - 0.02
    assert face_m - 0.012 < limited.fast_m[0] < limited.fast_m[7] <= face_m
    # A limit above the inflation has no effect and is not counted.
    loose = fingers_about(TARGET, 0.021)
    assert loose.counts[Count.LIMITED] == 0
    np.testing.assert_array_equal(loose.fast_m, free.fast_m)


@pytest.mark.parametrize("object_class", [OBSTACLE, TOUCHABLE])
def test_towards_anything_else_it_is_never_reduced(object_class: int) -> None:
    free = fingers_about(object_class, np.inf)
    limited = fingers_about(object_class, 0.004)
    np.testing.assert_array_equal(limited.fast_m, free.fast_m)
    assert limited.counts[Count.LIMITED] == 0


def test_a_limited_finger_still_meets_what_is_ahead_of_it() -> None:
    """Slow onset distances take the expected position: they are later by the limited inflation minus D_σ(0.5)."""
    pose = free_pose([[0.0, 0.0, 0.0]], [0.008], [True])
    looked = along(AHEAD, 0.001, variance_m2=1e-4, quantile=2.0)
    found = look(pose, WALL, looked, classes=[TARGET], widest_m=0.004)
    as_if = look(pose, WALL, along(AHEAD, 0.004), classes=[OBSTACLE])
    np.testing.assert_allclose(found.fast_m, as_if.fast_m)
    np.testing.assert_allclose(found.slow_m[:4], as_if.fast_m[:4] + 0.004 - 0.001)


def test_a_target_drawn_in_between_the_fingers_ends_before_the_palm() -> None:
    """R2 is free up to the palm, as far as the block still goes in: its sides, between the fingers, are not felt."""
    pose = gripper_pose()
    palm_m = -0.105 + 0.040 + 0.003
    left = []
    for depth_m in (0.03, 0.01, -0.01, -0.03):
        target = Scene().add().box([0.004, 0.0, depth_m], [0.02, 0.02, 0.02]).objects()
        found = look(pose, target, DOUBTFUL, classes=[TARGET], widest_m=0.5 * OPENING_M)
        free_m = depth_m - 0.02 - palm_m - INFLATED_M
        assert free_m - 0.012 < found.fast_m[0] < free_m - 0.009
        left.append(found.slow_m[0] - depth_m)
    np.testing.assert_allclose(left, left[0], atol=EQUAL_M)
