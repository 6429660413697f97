"""Σ V_ij of many spheres with all objects, against overlaps that are computed one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from feelahead.lab.reference.solids import Solids
from robot_side.field.object_class import SKIPPED, TARGET
from robot_side.field.total_overlap import OverlapsAlong, overlaps_along, total_overlap_m3
from robot_side.overlap import sphere_sphere
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.field.fields import REACH_M, along, ball_pose, ways_of
from tests.helpers.perceived_scenes import Scene, random_scene


def total(spheres: FloatArray, objects: PerceivedObjects, passed_over: frozenset[int] = frozenset()) -> float:
    classes = np.zeros(len(objects.names), dtype=np.int64)
    classes[list(passed_over)] = SKIPPED
    return total_overlap_m3(spheres, scene_table(objects), classes)


def any_spheres(rng: np.random.Generator, count: int) -> FloatArray:
    return np.concatenate([rng.uniform(-0.4, 0.4, (count, 3)), rng.uniform(0.0, 0.2, (count, 1))], axis=1)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), of_each_kind=st.integers(0, 5), count=st.integers(1, 6))
def test_it_is_the_sum_over_all_pairs_but_those_passed_over(seed: int, of_each_kind: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    objects, spheres = random_scene(rng, of_each_kind, 0.4), any_spheres(rng, count)
    passed_over = frozenset(np.flatnonzero(rng.uniform(size=len(objects.names)) < 0.3).tolist())
    counted = [thing for thing in range(len(objects.names)) if thing not in passed_over]
    things, every = np.tile(counted, count).astype(np.int64), np.repeat(spheres, len(counted), axis=0)
    expected = float(Solids(objects).overlap(every[:, :3], every[:, 3], things)[0].sum())
    assert total(spheres, objects, passed_over) == pytest.approx(expected, rel=1e-9, abs=1e-18)


def test_more_spheres_than_are_worked_out_at_a_time_are_all_counted() -> None:
    rng = np.random.default_rng(4)
    objects, spheres = random_scene(rng, 2, 0.4), any_spheres(rng, 700)
    one_by_one = sum(total(sphere[None], objects) for sphere in spheres)
    assert total(spheres, objects) == pytest.approx(one_by_one, rel=1e-9)


def one_along(sphere: FloatArray, objects: PerceivedObjects, direction: FloatArray) -> OverlapsAlong:
    return overlaps_along(sphere[None], sphere[3:], direction, scene_table(objects), np.zeros(1, dtype=np.int64))


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6))
def test_ahead_and_behind_are_the_overlaps_by_the_way_on_which_they_grow(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    objects, spheres, direction = random_scene(rng, 2, 0.4), any_spheres(rng, count), rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    classes = np.zeros(len(objects.names), dtype=np.int64)
    found = overlaps_along(spheres, spheres[:, 3], direction, scene_table(objects), classes)
    back = overlaps_along(spheres, spheres[:, 3], -direction, scene_table(objects), classes)
    assert found.all_m3 == pytest.approx(total(spheres, objects), rel=1e-12)
    assert (found.behind_m3, found.ahead_m3) == pytest.approx((back.ahead_m3, back.behind_m3), rel=1e-12)
    assert found.ahead_m3 + found.behind_m3 <= found.all_m3 * (1.0 + 1e-12)
    # Σ V (û·n)⁺ over three axes and their opposites is between V and √3 V for each pair.
    axes = [overlaps_along(spheres, spheres[:, 3], axis, scene_table(objects), classes) for axis in np.eye(3)]
    whole = sum(one.ahead_m3 + one.behind_m3 for one in axes)
    assert found.all_m3 * (1.0 - 1e-9) <= whole <= 3.0**0.5 * found.all_m3 * (1.0 + 1e-9)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0, 90.0, 180.0])
@pytest.mark.parametrize("radius_m", [0.02, 0.005])
def test_a_ball_counts_by_where_it_is_also_once_it_is_swallowed(degrees: float, radius_m: float) -> None:
    sphere, angle = np.array([0.0, 0.0, 0.0, 0.05]), np.radians(degrees)
    at = 0.04 * np.array([np.sin(angle), 0.0, np.cos(angle)])
    objects = Scene().add().sphere(at, radius_m).objects()
    found = one_along(sphere, objects, np.array([0.0, 0.0, 1.0]))
    volume = float(sphere_sphere(sphere[None, :3], sphere[3:], at[None], np.array([radius_m]))[0])
    parts = max(np.cos(angle), 0.0) * volume, max(-np.cos(angle), 0.0) * volume
    assert tuple(found) == pytest.approx((volume, *parts), rel=1e-9, abs=1e-15 * volume)


def test_a_sphere_within_a_half_space_counts_for_the_way_into_it() -> None:
    ground = Scene().add().half_space([0.0, 0.0, 1.0], 0.5).objects()
    found = one_along(np.array([0.0, 0.0, 0.0, 0.05]), ground, np.array([0.0, 0.0, -1.0]))
    assert found.ahead_m3 == found.all_m3 > 0.0


def test_a_target_meets_the_radii_that_are_given_for_it() -> None:
    rng = np.random.default_rng(9)
    objects, spheres = random_scene(rng, 2, 0.3), any_spheres(rng, 5)
    smaller = spheres * np.array([1.0, 1.0, 1.0, 0.5])
    classes = np.zeros(len(objects.names), dtype=np.int64)
    classes[2] = TARGET
    found = overlaps_along(spheres, smaller[:, 3], np.array([0.0, 0.0, 1.0]), scene_table(objects), classes)
    others = [thing for thing in range(len(objects.names)) if thing != 2]
    expected = total(spheres, objects, frozenset({2})) + total(smaller, objects, frozenset(others))
    assert found.all_m3 == pytest.approx(expected, rel=1e-9)
    assert found.all_m3 < total(spheres, objects)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_sphere_that_is_not_finite_is_named_and_never_silently_far_away(bad: float) -> None:
    spheres = any_spheres(np.random.default_rng(5), 3)
    spheres[1, 3] = bad
    with pytest.raises(ValueError, match="spheres holds NaN or infinity"):
        total(spheres, random_scene(np.random.default_rng(6), 1))


@pytest.mark.parametrize("seed", range(3))
def test_of_many_objects_none_is_passed_over(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene, spheres = Scene(), any_spheres(rng, 5)
    centers_m, radii_m = rng.uniform(-2.0, 2.0, (10_000, 3)), rng.uniform(0.005, 0.05, 10_000)
    for center, radius in zip(centers_m, radii_m, strict=True):
        scene.add().sphere(center, float(radius))
    expected = sum(sphere_sphere(sphere[None, :3], sphere[3:], centers_m, radii_m).sum() for sphere in spheres)
    assert expected > 0.0
    assert total(spheres, scene.objects()) == pytest.approx(float(expected), rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_ways_among_many_objects_are_those_among_the_near_ones(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centers_m, half_sizes_m = rng.uniform(-2.0, 2.0, (10_000, 3)), rng.uniform(0.005, 0.05, (10_000, 3))
    near = np.linalg.norm(centers_m, axis=1) < 2.0 * REACH_M
    scenes = []
    for kept in (np.ones_like(near), near):
        scene = Scene()
        for center, half in zip(centers_m[kept], half_sizes_m[kept], strict=True):
            scene.add().box(center, half)
        scenes.append(scene.objects())
    direction = rng.normal(size=3)
    looked = along(direction / np.linalg.norm(direction), 0.003)
    onsets_m = [ways_of(ball_pose(0.05), objects, looked) for objects in scenes]
    assert np.isfinite(onsets_m[0]).any()
    np.testing.assert_allclose(onsets_m[0], onsets_m[1], rtol=1e-12)
