import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from common.arrays import BoolArray, FloatArray
from robot_side.gripper.spheres import SphereCover, cover_boxes

PALM_M, FINGER_M, FINGERTIP_M = (0.032, 0.05, 0.04), (0.011, 0.007, 0.02), (0.011, 0.006, 0.02)
TOLERANCE_M = 1e-9
SIDES = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0])).reshape(3, -1).T

# From cubes to plates and rods, evenly over the orders of magnitude.
half_size = st.floats(math.log(0.001), math.log(0.2)).map(math.exp)
boxes = st.tuples(half_size, half_size, half_size)
stand_outs = st.floats(0.001, 0.01)


def cover_one(half_sizes_m: tuple[float, ...], stand_out_m: float) -> SphereCover:
    return cover_boxes(np.zeros((1, 3)), np.eye(3)[None], np.array([half_sizes_m]), stand_out_m)


def uncovered_cells(half_sizes_m: FloatArray, cover: SphereCover) -> FloatArray:
    """Return the middles of the smallest cells of a box's surface that no single sphere contains.

    This is a proof, not a sample. Cells tile the faces, with edges and corners. A cell counts as covered only if one
    sphere, made larger by TOLERANCE_M, contains the cell's farthest point. All other cells are cut, down to that
    tolerance. One eighth of the box is enough, because the spheres are mirror-symmetric.
    """
    spheres = np.unique(np.column_stack([np.abs(cover.centers_m), cover.radii_m + TOLERANCE_M]), axis=0)
    left = []
    for axis in range(3):
        in_face = np.arange(3) != axis
        middles, halves = np.where(in_face, 0.5, 1.0)[None] * half_sizes_m, 0.5 * half_sizes_m * in_face
        smallest_yet = False
        while len(middles) and not smallest_yet:
            smallest_yet = bool(halves.max() < 0.25 * TOLERANCE_M)
            # Neighbours stay neighbours, so that few spheres are near a piece of the list.
            pieces = np.array_split(middles, 1 + len(middles) // 64)
            middles = np.concatenate([piece[~_contained(piece, halves, spheres)] for piece in pieces])
            # Long cells are cut across until they are almost square.
            cut = halves > 0.5 * halves.max()
            halves = np.where(cut, 0.5 * halves, halves)
            middles = (middles[:, None] + np.unique(SIDES * cut, axis=0) * halves).reshape(-1, 3)
        left.append(middles)
    return np.concatenate(left)


def _contained(middles: FloatArray, halves: FloatArray, spheres: FloatArray) -> BoolArray:
    """Return, for each cell, whether any one of the spheres contains the whole cell."""
    low, high = middles.min(axis=0) - halves, middles.max(axis=0) + halves
    centers, squared_radii = spheres[:, :3], spheres[:, 3] ** 2
    near = ((np.clip(centers, low, high) - centers) ** 2).sum(axis=1) <= squared_radii
    farthest = np.abs(middles[:, None] - centers[near]) + halves
    contained: BoolArray = ((farthest**2).sum(axis=2) <= squared_radii[near]).any(axis=1)
    return contained


@settings(derandomize=True, deadline=None, max_examples=100)
@given(half_sizes_m=boxes, stand_out_m=stand_outs)
@example(half_sizes_m=PALM_M, stand_out_m=0.003)
@example(half_sizes_m=FINGER_M, stand_out_m=0.003)
@example(half_sizes_m=FINGERTIP_M, stand_out_m=0.003)
@example(half_sizes_m=(0.05, 0.05, 0.05), stand_out_m=0.003)
@example(half_sizes_m=(0.001, 0.03, 0.05), stand_out_m=0.003)
@example(half_sizes_m=(0.001, 0.05, 0.001), stand_out_m=0.01)
@example(half_sizes_m=(0.0, 0.03, 0.05), stand_out_m=0.003)
@example(half_sizes_m=(0.0, 0.05, 0.0), stand_out_m=0.003)
@example(half_sizes_m=(0.0, 0.0, 0.0), stand_out_m=0.003)
@example(half_sizes_m=(10.0, 0.1, 5.0), stand_out_m=0.003)
def test_no_point_of_the_surface_is_outside_and_no_sphere_stands_out_too_far(
    half_sizes_m: tuple[float, ...], stand_out_m: float
) -> None:
    half_sizes = np.array(half_sizes_m)
    cover = cover_one(half_sizes_m, stand_out_m)
    assert len(cover.radii_m) <= 2000

    # For a centre in the box, the farthest outside point is straight above the nearest face.
    depths = (half_sizes - np.abs(cover.centers_m)).min(axis=1)
    assert (depths >= -1e-15).all()
    assert (cover.radii_m - depths).max() <= cover.stand_out_m[0] * (1.0 + 1e-12)
    assert (cover.stand_out_m[0] == stand_out_m) or (len(cover.radii_m) > 1000)

    spheres = np.column_stack([cover.centers_m, cover.radii_m])
    in_order = spheres[np.lexsort(spheres.T)]
    for axis in range(3):
        mirrored = spheres.copy()
        mirrored[:, axis] *= -1.0
        np.testing.assert_array_equal(mirrored[np.lexsort(mirrored.T)], in_order)

    assert len(uncovered_cells(half_sizes, cover)) == 0


def test_the_built_in_gripper_needs_few_spheres() -> None:
    half_sizes = np.array([PALM_M, FINGER_M, FINGER_M, FINGERTIP_M, FINGERTIP_M])
    cover = cover_boxes(np.zeros((5, 3)), np.tile(np.eye(3), (5, 1, 1)), half_sizes)
    np.testing.assert_array_less(np.bincount(cover.box), np.array([158, 26, 26, 18, 18]) + 1)
    # A sphere covers at most 2√2 stand-outs of an edge, so that these boxes' edges alone take about 188.
    assert len(cover.radii_m) <= 246


def test_a_very_large_box_stands_out_as_2000_spheres_require_and_others_as_set() -> None:
    half_sizes = np.array([(0.05, 5.0, 5.0), PALM_M])
    cover = cover_boxes(np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)), half_sizes)
    wall = int((cover.box == 0).sum())
    assert 1900 <= wall <= 2000
    assert cover.stand_out_m[1] == 0.003
    assert cover.stand_out_m[0] > 0.003
    # With slightly less, 2000 spheres are too few: the distance is raised again, to the same value.
    less = cover_one((0.05, 5.0, 5.0), float(cover.stand_out_m[0]) * 0.999)
    assert less.stand_out_m[0] == pytest.approx(cover.stand_out_m[0], rel=1e-5)
