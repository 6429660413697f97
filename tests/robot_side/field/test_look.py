"""D_σ of each sphere against eq. 3-10 in NumPy, and which parts of a scene a look examines."""

import dataclasses
import math
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.enlargement.distance import Uncertainty
from robot_side.enlargement.kinematic_error import directional_variance, position_covariance
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.object_class import OBSTACLE, SKIPPED
from robot_side.field.scratch import MOST_WORK, Count, Error
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.field.fields import AHEAD, EQUAL_M, RADIUS_M, along, ball_pose, look
from tests.helpers.gripper_poses import free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

EMPTY = Scene().objects()
seeds = st.integers(0, 2**32 - 1)


def any_pose(rng: np.random.Generator, spheres: int, joints: int) -> GripperPose:
    return GripperPose(
        tool_position_m=rng.uniform(-1.0, 1.0, 3),
        tool_rotation=random_rotation(rng),
        tool_jacobian=rng.normal(size=(6, joints)),
        sphere_centers_m=rng.uniform(-1.0, 1.0, (spheres, 3)),
        sphere_radii_m=rng.uniform(0.001, 0.1, spheres),
        sphere_on_finger=np.zeros(spheres, dtype=np.bool_),
    )


def sigmas(by: Ahead, pose: GripperPose, looked: Along) -> FloatArray:
    """Return each sphere's inflation I and D_σ, in this order (m, 2)."""
    look(pose, EMPTY, looked, by=by)
    return np.hstack([by.scratch.inflation_m, by.scratch.sigma_m])[: len(pose.sphere_radii_m)]


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    seed=seeds,
    spheres=st.integers(1, 40),
    joints=st.integers(1, 8),
    p=st.floats(0.001, 0.999),
    mean_m=st.floats(-0.01, 0.01),
)
def test_the_enlargement_is_eq_10_for_each_sphere(
    seed: int, spheres: int, joints: int, p: float, mean_m: float
) -> None:
    rng = np.random.default_rng(seed)
    pose, encoder_sigma = any_pose(rng, spheres, joints), rng.uniform(0.0, 2e-3, joints)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    quantile, variance = NormalDist().inv_cdf(p), float(rng.uniform(0.0, 1e-4))
    mean_along_m, variance_along = float(rng.uniform(-0.01, 0.01)), float(rng.uniform(0.0, 1e-4))
    known = Along(direction, mean_m, variance, quantile, 0.1, mean_along_m, variance_along)
    by = Ahead(encoder_sigma)
    found = sigmas(by, pose, known)
    covariances = position_covariance(pose.sphere_jacobians, encoder_sigma)
    of_joints = directional_variance(covariances, np.tile(direction, (spheres, 1)))
    alone = np.maximum(0.0, mean_m + quantile * np.sqrt(of_joints + variance))
    whole = np.maximum(0.0, mean_m + mean_along_m + quantile * np.sqrt(of_joints + variance + variance_along))
    np.testing.assert_allclose(found[:, 0], alone, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found[:, 1], whole, rtol=1e-12, atol=1e-15)
    along_m = by.scratch.along_m
    assert along_m[Error.LARGEST] == found[:, 1].max()
    assert along_m[Error.ALONG] == max(0.0, (found[:, 1] - found[:, 0]).max())
    assert along_m[Error.EXPECTED] == pytest.approx(max(0.0, mean_m + mean_along_m), rel=1e-15)


@pytest.mark.parametrize("p", [0.9, 0.99])
def test_it_covers_the_drawn_errors_with_probability_p(p: float) -> None:
    """Draw the true positions of gripper and object many times: in a share P the gap is smaller by at most D_σ."""
    rng = np.random.default_rng(5)
    known = Uncertainty(p, (0.001, -0.002, 0.0005), 0.002, (0.0005, 0.001, -0.001))
    jacobian, encoder_sigma = rng.normal(size=(6, 6)), np.full(6, 1e-3)
    pose = dataclasses.replace(free_pose([[0.1, 0.2, 0.05]], [0.01]), tool_jacobian=jacobian)
    direction = np.array([0.6, 0.0, 0.8])
    looked = Along(direction, known.mean_along_m(direction), known.camera_sd_m**2, known.quantile, 0.1)
    distance = sigmas(Ahead(encoder_sigma), pose, looked)[0, 0]
    draws = 200_000
    covariance = position_covariance(pose.sphere_jacobians, encoder_sigma)[0]
    true_less_estimated = rng.multivariate_normal(known.kinematic_mean_m, covariance, draws)
    # e_c is the true minus the perceived position: an object with e_c along the direction is farther than it seems.
    camera_error = rng.normal(known.camera_mean_m, known.camera_sd_m, (draws, 3))
    closing = (true_less_estimated - camera_error) @ direction
    assert (closing <= distance).mean() == pytest.approx(p, abs=4.0 * math.sqrt(p * (1.0 - p) / draws))


def test_what_is_far_beside_or_behind_costs_no_overlap() -> None:
    away = Scene()
    for place in ([0.5, 0.0, 0.0], [0.0, -0.5, 0.1], [0.0, 0.0, -0.5], [0.0, 0.0, 9.0]):
        away.add().box(place, [0.05, 0.05, 0.05]).add().sphere(place, 0.06)
    away.add().half_space([0.0, 0.0, 1.0], -0.3).add().half_space([1.0, 0.0, 0.0], -0.3)
    found = look(gripper_pose(), away.objects(), along(AHEAD, 0.007, reach_m=0.3))
    assert np.isinf(found.fast_m).all()
    assert np.isinf(found.slow_m).all()
    assert found.counts.tolist() == [0] * len(Count)
    near = away.add().box([0.0, 0.0, 0.2], [0.05, 0.05, 0.05]).objects()
    counts = look(gripper_pose(), near, along(AHEAD, 0.007, reach_m=0.3)).counts
    assert counts[Count.PAIRS] > 0
    assert counts[Count.OVERLAPS] > 0


def test_a_scene_of_many_far_things_is_as_quickly_told_as_one() -> None:
    """Overlaps are computed only for objects that may shorten an onset distance: those behind the wall cost nothing."""
    wall = Scene().add().box([0.0, 0.0, 0.15], [0.3, 0.3, 0.01])
    looked = along(AHEAD, 0.007, reach_m=0.3)
    expected = look(gripper_pose(), wall.objects(), looked)
    rng = np.random.default_rng(1)
    for _ in range(500):
        wall.add().box([*rng.uniform(-0.2, 0.2, 2), rng.uniform(0.2, 0.3)], rng.uniform(0.01, 0.03, 3))
    found = look(gripper_pose(), wall.objects(), looked)
    np.testing.assert_array_equal(found.fast_m, expected.fast_m)
    assert found.counts[Count.OVERLAPS] == expected.counts[Count.OVERLAPS]


def test_a_look_at_too_much_ends_soon_and_takes_all_for_near() -> None:
    """Thousands of boxes or tetrahedra that overlap the gripper and each other cost no more than the limit."""
    rng, corners = (
        np.random.default_rng(1),
        np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    )
    boxes, wedges = Scene(), Scene().add()
    for _ in range(2000):
        boxes.add().box([*rng.uniform(-0.05, 0.05, 3)], rng.uniform(0.05, 0.2, 3))
        wedges.tetrahedron(rng.uniform(-0.3, 0.3, 3) + 0.5 * (corners - 0.3))
    for scene, most in ((boxes, 100), (wedges, 600)):
        found = look(gripper_pose(), scene.objects(), along(AHEAD, 0.007, reach_m=0.3))
        assert found.counts[Count.CUT] == 1
        assert MOST_WORK < found.counts[Count.PAIRS] + found.counts[Count.OVERLAPS] <= MOST_WORK + most
        assert not found.fast_m.any()
        assert not found.slow_m.any()


@pytest.mark.parametrize("name", ["tool_position_m", "tool_jacobian", "sphere_centers_m", "sphere_radii_m"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_pose_that_is_not_finite_is_named_and_never_silently_far_away(name: str, bad: float) -> None:
    pose = gripper_pose()
    values = getattr(pose, name).copy()
    values.reshape(-1)[-1] = bad
    objects = random_scene(np.random.default_rng(1), 2)
    with pytest.raises(ValueError, match=f"pose.{name} holds NaN or infinity"):
        look(dataclasses.replace(pose, **{name: values}), objects, along())


def test_what_is_far_behind_something_swallowed_is_early_and_never_silent() -> None:
    scene = Scene().add().box([0.0, 0.0, -0.01], [0.05, 0.05, 0.01])
    objects = scene.box([0.0, 0.0, 0.05], [0.001, 0.001, 0.001]).box([0.0, 0.0, 0.9], [0.5, 0.5, 0.02]).objects()
    found = look(ball_pose(), objects, along(reach_m=3.0))
    assert found.fast_m[0] <= 0.9 - 0.02 - RADIUS_M


@pytest.mark.parametrize("seed", range(12))
def test_each_of_many_objects_that_the_enlarged_gripper_overlaps_counts_as_if_it_were_alone(seed: int) -> None:
    rng, scene = np.random.default_rng(seed), Scene()
    pose = free_pose(rng.uniform(-0.02, 0.02, (8, 3)), [0.008] * 8)
    for _ in range(12):
        scene.add().box(rng.uniform(-0.05, 0.05, 3), rng.uniform(0.001, 0.01, 3), random_rotation(rng))
    objects, ahead, by = scene.objects(), along(AHEAD, 0.02), Ahead(np.zeros(6))
    together_m = look(pose, objects, ahead, by=by).fast_m
    alone_m = []
    for thing in range(12):
        classes = [OBSTACLE if one == thing else SKIPPED for one in range(12)]
        alone_m.append(look(pose, objects, ahead, classes=classes, by=by).fast_m)
    np.testing.assert_allclose(together_m, np.min(alone_m, axis=0), rtol=0.0, atol=EQUAL_M)


def test_of_full_strength_alone_a_look_tells_the_same() -> None:
    rng = np.random.default_rng(2)
    pose, scene = free_pose(rng.uniform(-0.02, 0.02, (8, 3)), [0.008] * 8), Scene()
    for _ in range(20):
        scene.add().box(rng.uniform(-0.1, 0.1, 3), rng.uniform(0.001, 0.02, 3), random_rotation(rng))
    table, classes = scene_table(scene.objects()), np.full(20, OBSTACLE, dtype=np.int64)
    by = Ahead(np.zeros(6))
    whole, last = (by.look(pose, table, classes, along(AHEAD, 0.01), full_only=only) for only in (False, True))
    assert np.isfinite(whole.onsets_m[:, -1]).all()
    np.testing.assert_allclose(last.onsets_m[:, -1], whole.onsets_m[:, -1], rtol=0.0, atol=EQUAL_M)
