"""Objects to be touched: a target, or a support while something is held. Slow zones get less strength, and later."""

import numpy as np
import pytest

from robot_side.field.along import Along
from robot_side.field.field import Field
from robot_side.field.object_class import OBSTACLE, TARGET, TOUCHABLE
from robot_side.field.scratch import TOUCH_STRENGTH, Count
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, EQUAL_M, along, ball_pose, look
from tests.helpers.gripper_poses import OPENING_M, free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene

MEAN_M, SD_M, QUANTILE = 0.002, 0.003, 2.33
INFLATED_M = MEAN_M + QUANTILE * SD_M
DOUBTFUL = along(AHEAD, MEAN_M, variance_m2=SD_M**2, quantile=QUANTILE)
WALL = Scene().add().box([0.0, 0.0, 0.15], [0.2, 0.2, 0.05]).objects()


def one(object_class: int, objects: PerceivedObjects = WALL, looked: Along = DOUBTFUL) -> Field:
    return look(ball_pose(), objects, looked, classes=[object_class])


@pytest.mark.parametrize("object_class", [TARGET, TOUCHABLE])
def test_it_is_in_the_fast_list_like_an_obstacle_and_in_the_slow_one_at_most_half_as_strong(object_class: int) -> None:
    obstacle, touched = one(OBSTACLE), one(object_class)
    np.testing.assert_array_equal(touched.fast_m, obstacle.fast_m)
    # At its expected position: the fast onset distance plus D_σ(P) - D_σ(0.5).
    expected = obstacle.fast_m[:TOUCH_STRENGTH] + INFLATED_M - MEAN_M
    np.testing.assert_allclose(touched.slow_m[:TOUCH_STRENGTH], expected, atol=1e-12)
    assert TOUCH_STRENGTH == 4
    assert np.isinf(touched.slow_m[TOUCH_STRENGTH:]).all()


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
