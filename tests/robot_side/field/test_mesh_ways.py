"""First contacts and onset distances of a moving sphere with closed meshes of any form, against the definition."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray, IntArray
from robot_side.field.look import MARGIN_M
from robot_side.overlap import Mesh
from robot_side.surroundings.kinds.layout import LEAST_CONTACT_M
from tests.helpers.field.fields import AHEAD, EQUAL_M, along, ball_pose, judged
from tests.helpers.field.first_contact import first_contact_m
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES, cup, hollow_cube
from tests.helpers.perceived_scenes import Scene, random_rotation

REACH_M = 0.15
seeds = st.integers(0, 2**32 - 1)


def star(rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
    """Draw a prism over a polygon with dents, some 60 mm wide and up to 60 mm high."""
    corners = 2 * int(rng.integers(3, 9))
    turns = 2.0 * np.pi * (np.arange(corners) + rng.uniform(0.0, 0.4, corners)) / corners
    reach = np.where(np.arange(corners) % 2, rng.uniform(0.008, 0.02), rng.uniform(0.02, 0.05, corners))
    flat = np.column_stack([reach * np.cos(turns), reach * np.sin(turns)])
    half = float(rng.uniform(0.005, 0.03))
    rings = [np.column_stack([flat, np.full(corners, z)]) for z in (-half, half)]
    vertices = np.concatenate([*rings, [[0.0, 0.0, -half], [0.0, 0.0, half]]])
    low, up = np.arange(corners), corners + np.arange(corners)
    next_low, next_up = np.roll(low, -1), np.roll(up, -1)
    under, over = np.full(corners, 2 * corners), np.full(corners, 2 * corners + 1)
    sides = np.column_stack([low, next_low, next_up]), np.column_stack([low, next_up, up])
    ends = np.column_stack([under, next_low, low]), np.column_stack([over, up, next_up])
    return vertices, np.concatenate([*sides, *ends])


def any_mesh(rng: np.random.Generator) -> Mesh:
    return Mesh(*(star(rng), star(rng), hollow_cube(), cup())[int(rng.integers(4))])


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=seeds)
def test_the_ways_to_a_mesh_are_those_of_the_definition(seed: int) -> None:
    """The sphere starts before the mesh, in one of its dents, in its cavity, or overlapping it."""
    rng = np.random.default_rng(seed)
    mesh, radius, inflated = any_mesh(rng), float(rng.uniform(0.004, 0.015)), float(rng.uniform(0.0, 0.01))
    rotation, start = random_rotation(rng), rng.uniform(-0.06, 0.06, 3)
    objects = Scene().add().mesh(mesh, [0.0, 0.0, 0.0], rotation).objects()
    off = judged(ball_pose(radius, tool_position_m=start), objects, along(AHEAD, inflated, reach_m=REACH_M))
    assert np.abs(off.off_m).max(initial=0.0) < EQUAL_M


@pytest.mark.parametrize("gap_m", [0.0, 5e-8, -5e-8])
def test_what_is_touched_exactly_is_entered_at_once_and_what_rests_beside_never(gap_m: float) -> None:
    box = Scene().add().mesh(Mesh(CUBE_CORNERS * 0.05, CUBE_TRIANGLES), [0.0, 0.0, 0.0]).objects()
    start = np.array([0.01, 0.012, -0.05 - 0.008 - gap_m])
    assert LEAST_CONTACT_M <= first_contact_m(box, start, 0.008, AHEAD, REACH_M + MARGIN_M) <= 1e-7
    for away in (-AHEAD, np.array([1.0, 0.0, 0.0])):
        assert np.isinf(first_contact_m(box, start, 0.008, away, REACH_M + MARGIN_M))


def test_walls_that_lean_in_are_entered_and_walls_that_lead_away_are_not() -> None:
    for degrees, sign in itertools.product((0.05, 0.3, 2.0), (1.0, -1.0)):
        angle = sign * np.radians(degrees)
        turned = np.array([[np.cos(angle), 0.0, -np.sin(angle)], [0.0, 1.0, 0.0], [np.sin(angle), 0.0, np.cos(angle)]])
        # The sphere starts 0.1 mm beside a plate 20 mm thick and 1 m long.
        plate = Scene().add().mesh(Mesh(CUBE_CORNERS * [0.01, 0.5, 0.5], CUBE_TRIANGLES), [0.0, 0.0, 0.0], turned)
        start = turned @ [-0.01 - 0.008 - 1e-4, 0.0, 0.0]
        found = first_contact_m(plate.objects(), start, 0.008, AHEAD, REACH_M + MARGIN_M)
        leans_in = sign > 0.0
        assert (found == pytest.approx(1e-4 / np.sin(abs(angle)), rel=1e-6)) if leans_in else np.isinf(found)
