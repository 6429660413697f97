"""Pictures of a camera that errs: how much, how alike from pixel to pixel and picture to picture, and at edges."""

from dataclasses import replace

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.depth.picture import DepthArray, Pinhole
from robot_side.depth.sensor_errors import ErrorMaker
from robot_side.depth.sensors import SENSORS, SensorErrors

SHAPE = (240, 320)
D435 = SENSORS["d435"]
NATIVE = Pinhole(D435.focal_px, D435.focal_px, 160.0, 120.0)
"""A part of the camera's own picture, whose pixels are those of its figures"""
SMOOTH = replace(D435, step_per_m=0.0, drop_out_share=0.0, constant_share=0.0)


def wall(depth_m: float) -> DepthArray:
    return np.full(SHAPE, depth_m, dtype=np.float32)


def errors(sensor: SensorErrors, depth_m: float, count: int, level: float = 1.0, seed: int = 5) -> FloatArray:
    """Return the errors of 1/z (count, h, w) in 1/m, towards a wall at `depth_m`."""
    maker = ErrorMaker(sensor, NATIVE, SHAPE, seed, level)
    return np.array([1.0 / maker.apply(wall(depth_m)).astype(np.float64) - 1.0 / depth_m for _ in range(count)])


@pytest.mark.parametrize("level", [1.0, 2.0])
@pytest.mark.parametrize("depth_m", [0.3, 1.0, 2.0])
def test_the_disparity_errs_as_much_at_any_distance_and_the_depth_by_its_square(depth_m: float, level: float) -> None:
    found = errors(SMOOTH, depth_m, 20, level)
    # 0.08 px at 447 px and 50 mm.
    assert found.std() * 447.0 * 0.05 == pytest.approx(0.08 * level, rel=0.05)
    assert SMOOTH.depth_errors(level).sd_m(depth_m) == pytest.approx(found.std() * depth_m**2, rel=0.05)


@pytest.mark.parametrize(("pixels", "measured"), [(1, 0.87), (4, 0.58), (8, 0.37)])
def test_errors_of_neighbours_are_as_alike_as_those_of_a_real_matcher(pixels: int, measured: float) -> None:
    found = errors(SMOOTH, 1.0, 20)
    for first, other in (
        (found[:, :, :-pixels], found[:, :, pixels:]),
        (found[:, :-pixels], found[:, pixels:]),
    ):
        assert np.mean(first * other) / found.var() == pytest.approx(measured, abs=0.04)


def test_a_smaller_picture_of_the_same_camera_has_errors_alike_over_fewer_pixels() -> None:
    maker = ErrorMaker(SMOOTH, replace(NATIVE, fx=0.5 * NATIVE.fx), SHAPE, 5)
    found = np.array([1.0 / maker.apply(wall(1.0)) - 1.0 for _ in range(20)], dtype=np.float64)
    assert np.mean(found[:, :, :-4] * found[:, :, 4:]) / found.var() == pytest.approx(0.37, abs=0.04)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_share_of_the_errors_stays_for_the_whole_run(share: float) -> None:
    found = errors(replace(SMOOTH, constant_share=share), 1.0, 30)
    between = np.mean([np.mean(found[k] * found[k + 1]) for k in range(29)]) / found.var()
    assert between == pytest.approx(share, abs=0.06)


def test_the_same_seed_makes_the_same_pictures_and_another_one_others() -> None:
    first, again, other = (ErrorMaker(D435, NATIVE, SHAPE, seed) for seed in (1, 1, 2))
    for _ in range(3):
        seen = first.apply(wall(1.0))
        assert np.array_equal(seen, again.apply(wall(1.0)))
        assert not np.array_equal(seen, other.apply(wall(1.0)))


@pytest.mark.parametrize("level", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("name", ["d435", "azure_kinect"])
def test_nothing_is_measured_nearer_than_the_least_range_or_beyond_the_most(name: str, level: float) -> None:
    sensor = SENSORS[name]
    maker = ErrorMaker(sensor, NATIVE, SHAPE, 3, level)
    for limit_m in (sensor.least_m, sensor.most_m):
        seen = maker.apply(wall(limit_m))
        assert ((seen == 0.0) | ((seen >= sensor.least_m) & (seen <= sensor.most_m))).all()
        assert np.mean(seen > 0.0) > 0.3
    for beyond_m in (0.0, 0.9 * sensor.least_m, 1.3 * sensor.most_m):
        assert not maker.apply(wall(beyond_m)).any()


def test_a_tilted_surface_is_no_edge() -> None:
    sensor = replace(D435, drop_out_share=0.0, edge_hole_share=1.0)
    slant = (1.0 / np.linspace(0.8, 1.6, SHAPE[1])).astype(np.float32)
    assert (ErrorMaker(sensor, NATIVE, SHAPE, 3).apply(np.broadcast_to(slant, SHAPE)) > 0.0).all()


def test_without_errors_the_depth_is_the_true_one() -> None:
    true_m = np.random.default_rng(1).uniform(0.2, 2.9, SHAPE).astype(np.float32)
    assert np.array_equal(ErrorMaker(D435, NATIVE, SHAPE, 1, level=0.0).apply(true_m), true_m)
    seen = ErrorMaker(SENSORS["ideal"], NATIVE, SHAPE, 1).apply(true_m)
    assert np.abs(seen - true_m).max() < 1e-6


def test_disparity_comes_in_steps() -> None:
    sensor = SensorErrors(growth_per_m=D435.growth_per_m, step_per_m=D435.step_per_m)
    steps = (errors(sensor, 1.0, 1)[0] + 1.0) / D435.step_per_m
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    assert len(np.unique(np.rint(steps))) > 10
    assert sensor.depth_errors().growth_per_m > sensor.growth_per_m


@pytest.mark.parametrize("level", [0.5, 1.0])
def test_edges_are_mixed_or_holes_and_surfaces_are_neither(level: float) -> None:
    true_m = wall(1.0)
    true_m[:, 160:] = 0.5
    maker = ErrorMaker(replace(D435, drop_out_share=0.0), NATIVE, SHAPE, 2, level)
    seen = np.array([maker.apply(true_m) for _ in range(20)])
    edge = seen[:, :, 159:161]
    assert np.mean(edge == 0.0) == pytest.approx(0.23 * level, abs=0.02)
    # Of those that are mixed, 9 of 10 are more than 25 mm from either surface.
    assert np.mean((edge > 0.525) & (edge < 0.975)) == pytest.approx(0.9 * 0.3 * level, abs=0.02)
    inside = np.delete(seen, [159, 160], axis=2)
    assert np.abs(inside - np.delete(true_m, [159, 160], axis=1)).max() < 0.04 * level


def test_nothing_is_mixed_where_nothing_lies_behind() -> None:
    true_m = wall(0.5)
    true_m[:, 160:] = 0.0
    seen = np.array([ErrorMaker(D435, NATIVE, SHAPE, seed).apply(true_m) for seed in range(5)])
    assert (np.abs(seen[seen > 0.0] - 0.5) < 0.01).all()
    assert (seen[:, :, 160:] == 0.0).all()
    assert np.mean(seen[:, :, 159] == 0.0) == pytest.approx(0.53, abs=0.05)


def test_some_pixels_drop_out_twice_as_many_at_level_2() -> None:
    for level in (1.0, 2.0):
        maker = ErrorMaker(D435, NATIVE, SHAPE, 4, level)
        assert np.mean([maker.apply(wall(0.6)) == 0.0 for _ in range(5)]) == pytest.approx(0.01 * level, rel=0.1)


def test_a_level_below_zero_is_refused() -> None:
    with pytest.raises(ValueError, match=r"level = -1.0; valid: 0 or more"):
        ErrorMaker(D435, NATIVE, SHAPE, 1, level=-1.0)
