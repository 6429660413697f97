import numpy as np
import pytest

from robot_side.depth.boxes import Boxes
from robot_side.depth.picture import DepthErrors
from robot_side.depth.surface_errors import surface_sds

ERRORS = DepthErrors(growth_per_m=0.004, correlation=0.016)


def _boxes(half_sizes_m: list[tuple[float, float]], sd_m: float) -> Boxes:
    count = len(half_sizes_m)
    return Boxes(
        ids=np.arange(count),
        centers_m=np.zeros((count, 3)),
        rotations=np.tile(np.eye(3), (count, 1, 1)),
        half_sizes_m=np.array([(*halves, 0.01) for halves in half_sizes_m]),
        roles=np.full(count, -1),
        sds_m=np.full(count, sd_m),
    )


def test_a_surface_as_small_as_its_pixels_correlation_errs_as_a_pixel() -> None:
    # 4 mm is the error at 1 m, where errors are alike within 16 mm.
    sds_m = surface_sds(_boxes([(0.005, 0.005), (0.016, 0.016)], 0.004), np.array([0, 1]), ERRORS)
    assert sds_m == pytest.approx([0.004, 0.004])


def test_a_large_surface_errs_less_by_the_root_of_its_patches() -> None:
    sds_m = surface_sds(_boxes([(0.08, 0.064)], 0.004), np.array([0]), ERRORS)
    # 160 mm by 128 mm hold 5 by 4 patches of 32 mm.
    assert sds_m == pytest.approx([0.004 / np.sqrt(20.0)])


def test_pieces_of_a_plane_err_alike_and_by_their_areas() -> None:
    boxes = _boxes([(0.08, 0.064), (0.005, 0.005)], 0.004)
    large_m, small_m = surface_sds(boxes, np.array([0, 0]), ERRORS)
    assert large_m == small_m
    assert 0.004 / np.sqrt(20.0) < large_m < 0.0010


def test_without_a_correlation_length_nothing_is_averaged() -> None:
    assert surface_sds(_boxes([(0.08, 0.064)], 0.004), np.array([0]), DepthErrors(0.004)) == pytest.approx([0.004])
