from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.gripper.capsule_cover import cover_capsule
from robot_side.gripper.kept_covers import SearchNotes, kept_cover
from robot_side.gripper.search_work import SearchWork
from robot_side.gripper.solids import Solid, convex_solid, cylinder, ellipsoid, simpler_convex_solid
from robot_side.gripper.surface_cover import cover_surface
from tests.helpers.perceived_scenes import random_rotation

STAND_OUT_M = 0.003
size = st.floats(0.004, 0.03)
few, several = (settings(derandomize=True, deadline=None, max_examples=count) for count in (3, 5))


def points_on(solid: Solid, random: np.random.Generator, count: int = 20_000) -> FloatArray:
    corners = solid.corners_m
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    rows = random.choice(len(corners), count, p=areas / areas.sum())
    inner = np.einsum("nk,nki->ni", random.dirichlet(np.ones(3), count), corners[rows])
    return np.concatenate([inner, corners.reshape(-1, 3)])


def outside_m(points: FloatArray, centers: FloatArray, radii: FloatArray) -> FloatArray:
    pieces = np.array_split(points, 1 + len(points) // 4096)
    return np.concatenate([(np.linalg.norm(p[:, None] - centers, axis=2) - radii).min(axis=1) for p in pieces])


def check(solids: list[Solid], true_depth_m: Callable[[FloatArray], FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Cover solids; assert that spheres contain the whole surface, and that each protrudes by at most 3 mm."""
    centers, radii, stand_out_m = cover_surface(solids, STAND_OUT_M, [np.eye(3)])
    assert stand_out_m == STAND_OUT_M
    random = np.random.default_rng(0)
    for number, solid in enumerate(solids):
        points = points_on(solid, random)
        for other, its in enumerate(solids):
            if other != number:
                points = points[its.depth_m(points) <= 0.0]
        assert outside_m(points, centers, radii).max() <= 1e-12
    assert (radii - true_depth_m(centers)).max() <= STAND_OUT_M + 1e-9
    return centers, radii


@few
@given(radius=size, half=size)
def test_a_cylinder(radius: float, half: float) -> None:
    solid = cylinder(radius, half)
    assert solid is not None
    check([solid], lambda c: np.minimum(radius - np.hypot(c[:, 0], c[:, 1]), half - np.abs(c[:, 2])))


@several
@given(axes=st.tuples(size, size, size))
def test_an_ellipsoid(axes: tuple[float, float, float]) -> None:
    solid = ellipsoid(np.array(axes))
    assert solid is not None
    dense = np.random.default_rng(1).normal(size=(20_000, 3))
    surface = dense / np.linalg.norm(dense, axis=1)[:, None] * axes
    # The nearest of many points is a little farther off than the surface.
    spacing_m = 0.03 * max(axes)
    centers, radii, _ = cover_surface([solid], STAND_OUT_M, [np.eye(3)])
    assert outside_m(surface, centers, radii).max() <= 1e-12
    depths = np.array([np.linalg.norm(surface - center, axis=1).min() for center in centers])
    assert (radii - depths).max() <= STAND_OUT_M + spacing_m


@several
@given(seed=st.integers(0, 10_000))
def test_the_convex_hull_of_points(seed: int) -> None:
    random = np.random.default_rng(seed)
    solid = convex_solid(random.normal(size=(12, 3)) * random.uniform(0.004, 0.02, 3))
    assert solid is not None
    corners = solid.corners_m
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offsets = np.sum(normals * corners[:, 0], axis=1)
    check([solid], lambda c: (offsets - c @ normals.T).min(axis=1))


def test_a_finely_drawn_part_is_covered_by_way_of_few_faces() -> None:
    turns = np.linspace(0.0, 2.0 * np.pi, 1000, endpoint=False)
    ring = np.column_stack([0.02 * np.cos(turns), 0.015 * np.sin(turns)])
    drawn = np.concatenate([np.column_stack([ring, np.full(1000, z)]) for z in (-0.02, 0.03)])
    whole, simpler = convex_solid(drawn), simpler_convex_solid(drawn, 0.05 * STAND_OUT_M)
    assert whole is not None
    assert simpler is not None
    assert len(simpler.corners_m) < 0.2 * len(whole.corners_m)
    assert simpler.depth_m(drawn).min() >= -1e-9
    assert simpler.depth_m(drawn).max() <= 0.05 * STAND_OUT_M + 1e-9
    check([simpler], whole.depth_m)


def test_the_spheres_are_mirror_symmetric_where_the_shape_is() -> None:
    turn = random_rotation(np.random.default_rng(2))
    # A wedge: symmetric to one plane, and not to the other two.
    points = np.array([[x, y, z] for x in (-0.02, 0.02) for y, z in ((0.0, 0.0), (0.02, 0.0), (0.0, 0.03))])
    wedge = convex_solid(points)
    assert wedge is not None
    centers, radii, _ = cover_surface([wedge.placed(turn, np.array([0.1, 0.2, 0.3]))], STAND_OUT_M, [turn])
    local = (centers - [0.1, 0.2, 0.3]) @ turn
    for center, radius in zip(local * [-1.0, 1.0, 1.0], radii, strict=True):
        image = np.linalg.norm(local - center, axis=1).argmin()
        assert np.linalg.norm(local[image] - center) < 1e-6
        assert radii[image] == pytest.approx(radius, abs=1e-9)


def test_the_same_twice_and_what_would_need_too_many_stands_out_farther() -> None:
    solid = cylinder(0.01, 0.01)
    assert solid is not None
    first, second = (cover_surface([solid], STAND_OUT_M) for _ in range(2))
    np.testing.assert_array_equal(first[0], second[0])
    few_spheres = cover_surface([solid], STAND_OUT_M, most=len(first[1]) // 2)
    assert len(few_spheres[1]) <= len(first[1]) // 2
    assert few_spheres[2] > STAND_OUT_M


def test_a_search_whose_work_is_spent_gives_way_to_3_mm_and_says_how_far_it_is() -> None:
    solid = cylinder(0.02, 0.02)
    assert solid is not None
    told: list[float] = []
    work = SearchWork(0.0, told.append)
    centers, radii, stand_out_m = cover_surface([solid], 0.3 * STAND_OUT_M, work=work)
    assert (work.spent, stand_out_m) == (True, STAND_OUT_M)
    assert outside_m(points_on(solid, np.random.default_rng(0)), centers, radii).max() <= 1e-12
    assert told[0] == 0.0
    assert 0.5 < max(told) < 1.0


@settings(derandomize=True, deadline=None, max_examples=50)
@given(radius=st.floats(0.001, 0.1), half=st.floats(0.0, 0.3), stand_out=st.floats(0.001, 0.01))
def test_a_row_of_spheres_covers_a_capsule(radius: float, half: float, stand_out: float) -> None:
    centers, radii, stands_out_m = cover_capsule(radius, half, stand_out)
    assert (radii - radius).max() <= stands_out_m <= stand_out * (1.0 + 1e-9)
    random = np.random.default_rng(0)
    along = random.uniform(-half, half, 2000)
    turns = random.uniform(0.0, 2.0 * np.pi, 2000)
    side = np.column_stack([radius * np.cos(turns), radius * np.sin(turns), along])
    ends = random.normal(size=(500, 3))
    ends *= radius / np.linalg.norm(ends, axis=1)[:, None]
    ends[:, 2] += np.copysign(half, ends[:, 2])
    assert outside_m(np.concatenate([side, ends]), centers, radii).max() <= 1e-12
    np.testing.assert_array_equal(np.sort(centers[:, 2]), np.sort(-centers[:, 2]))


def test_searches_in_a_row_are_said_once_in_a_few_seconds() -> None:
    said: list[str] = []
    notes = SearchNotes(said.append)
    for number in range(5):
        notes.at(f"link {number}", 0.25)
    [line] = said
    assert "link 0, 25.0 % covered" in line


def test_a_cover_is_found_once_and_a_broken_file_is_made_anew(tmp_path: Path) -> None:
    made = []

    def make() -> tuple[FloatArray, FloatArray, float]:
        made.append(1)
        return np.ones((2, 3)), np.array([0.1, 0.2]), 0.003

    first, again = (kept_cover(b"shape", make, tmp_path) for _ in range(2))
    assert len(made) == 1
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert first[2] == again[2]
    kept_cover(b"other", make, tmp_path)
    assert len(made) == 2
    for file in tmp_path.iterdir():
        file.write_bytes(file.read_bytes()[:50])
    kept_cover(b"shape", make, tmp_path)
    assert len(made) == 3
