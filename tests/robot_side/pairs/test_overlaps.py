import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.objects.perceived import Role
from robot_side.overlap import kernels
from robot_side.pairs.candidates import candidate_pairs
from robot_side.pairs.overlaps import by_object, evaluate, nearest_surfaces, radii_for_role, select
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

seeds = st.integers(0, 2**32 - 1)
repeatable = settings(derandomize=True, deadline=None, max_examples=30)


@repeatable
@given(seed=seeds)
def test_each_row_is_its_own_pairs_overlap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 4, 0.4)
    centers, radii = rng.uniform(-0.4, 0.4, (4, 3)), rng.uniform(0.05, 0.3, 4)
    pairs = candidate_pairs(centers, radii, objects)
    pair_radii = radii[pairs.sphere_index] * rng.uniform(0.5, 1.0, len(pairs))
    overlaps = evaluate(centers, pair_radii, objects, pairs)
    for row in range(len(pairs)):
        center, radius = centers[pairs.sphere_index[row]][None], pair_radii[row : row + 1]
        one = slice(pairs.primitive_index[row], pairs.primitive_index[row] + 1)
        if row < pairs.spheres.stop:
            expected = kernels.sphere_pairs(center, radius, objects.sphere_centers_m[one], objects.sphere_radii_m[one])
        elif row < pairs.boxes.stop:
            expected = kernels.box_pairs(
                center, radius, objects.box_centers_m[one], objects.box_rotations[one], objects.box_half_sizes_m[one]
            )
        elif row < pairs.tetrahedra.stop:
            expected = kernels.tetrahedron_pairs(center, radius, objects.tetrahedron_vertices_m[one])
        else:
            expected = kernels.half_space_pairs(
                center, radius, objects.half_space_normals[one], objects.half_space_offsets_m[one]
            )
        assert overlaps.volume_m3[row] == expected[0][0]
        np.testing.assert_array_equal(overlaps.gradient_m2[row], expected[1][0])


@repeatable
@given(seed=seeds)
def test_distance_and_volume_agree_on_what_is_touched(seed: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 5, 0.4)
    centers, radii = rng.uniform(-0.4, 0.4, (5, 3)), rng.uniform(0.01, 0.2, 5)
    pairs = candidate_pairs(centers, radii, objects)
    overlaps = evaluate(centers, radii[pairs.sphere_index], objects, pairs, nearest_surfaces(centers, objects, pairs))
    depth = overlaps.radius_m - overlaps.signed_distance_m
    clear = np.abs(depth) > 1e-4
    np.testing.assert_array_equal((overlaps.volume_m3 > 0.0)[clear], (depth > 0.0)[clear])
    np.testing.assert_array_equal(overlaps.centre_inside, overlaps.signed_distance_m < 0.0)
    outside = ~overlaps.centre_inside
    np.testing.assert_array_equal(overlaps.deepening[outside], overlaps.nearest_direction[outside])


def test_a_cap_by_hand() -> None:
    objects = Scene().add().half_space([0.0, 0.0, 1.0], 0.0).objects()
    centers = np.array([[0.3, 0.2, 0.05]])
    pairs = candidate_pairs(centers, np.array([0.08]), objects)
    overlaps = evaluate(centers, np.array([0.08]), objects, pairs)
    depth = 0.03
    assert overlaps.volume_m3[0] == pytest.approx(math.pi * depth**2 * (3 * 0.08 - depth) / 3.0)
    disc = math.pi * (0.08**2 - 0.05**2)
    np.testing.assert_allclose(overlaps.gradient_m2[0], [0.0, 0.0, -disc])
    assert overlaps.signed_distance_m[0] == pytest.approx(0.05)
    np.testing.assert_allclose(overlaps.nearest_direction[0], [0.0, 0.0, -1.0])


@repeatable
@given(seed=seeds)
def test_a_box_made_of_tetrahedra_is_the_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    center, half_sizes, rotation = rng.normal(size=3) * 0.1, rng.uniform(0.05, 0.2, 3), random_rotation(rng)
    whole = Scene().add().box(center, half_sizes, rotation).objects()
    parts = Scene().add().box_of_tetrahedra(center, half_sizes, rotation).objects()
    centers, radii = center + rng.normal(size=(6, 3)) * 0.15, rng.uniform(0.02, 0.2, 6)
    found = []
    for objects in (whole, parts):
        pairs = candidate_pairs(centers, radii, objects)
        merged = by_object(evaluate(centers, radii[pairs.sphere_index], objects, pairs))
        found.append(select(merged, np.flatnonzero(merged.volume_m3 > 1e-12)))
    box, tetrahedra = found
    np.testing.assert_array_equal(box.sphere_index, tetrahedra.sphere_index)
    np.testing.assert_allclose(tetrahedra.volume_m3, box.volume_m3, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(tetrahedra.gradient_m2, box.gradient_m2, rtol=1e-6, atol=1e-10)
    np.testing.assert_array_equal(tetrahedra.centre_inside, box.centre_inside)
    outside = ~box.centre_inside
    np.testing.assert_allclose(tetrahedra.signed_distance_m[outside], box.signed_distance_m[outside], atol=1e-12)
    np.testing.assert_allclose(tetrahedra.nearest_direction[outside], box.nearest_direction[outside], atol=1e-6)
    assert (np.linalg.norm(tetrahedra.deepening, axis=1) <= 1.0 + 1e-12).all()


def test_by_object_keeps_objects_and_spheres_apart() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.1], 0.08).sphere([0.0, 0.0, -0.1], 0.08)
    objects = scene.add().sphere([0.1, 0.0, 0.0], 0.05).objects()
    centers, radii = np.array([[0.0, 0.0, 0.01], [0.01, 0.0, 0.0]]), np.full(2, 0.1)
    pairs = candidate_pairs(centers, radii, objects)
    overlaps = evaluate(centers, radii[pairs.sphere_index], objects, pairs)
    assert len(overlaps) == 6
    merged = by_object(overlaps)
    rows = list(zip(merged.sphere_index.tolist(), merged.object_index.tolist(), strict=True))
    assert sorted(rows) == [(0, 0), (0, 1), (1, 0), (1, 1)]
    for sphere, index in rows:
        same = (overlaps.sphere_index == sphere) & (overlaps.object_index == index)
        row = rows.index((sphere, index))
        assert merged.volume_m3[row] == pytest.approx(overlaps.volume_m3[same].sum())
        np.testing.assert_allclose(merged.gradient_m2[row], overlaps.gradient_m2[same].sum(axis=0))
        assert merged.signed_distance_m[row] == overlaps.signed_distance_m[same].min()
    # The sphere slightly above the middle is nearer to the upper ball.
    np.testing.assert_allclose(merged.nearest_direction[rows.index((0, 0))], [0.0, 0.0, 1.0])


def test_enlargement_is_limited_to_half_the_gap_towards_the_target_only() -> None:
    scene = Scene()
    for role in (Role.OBSTACLE, Role.TARGET, Role.SUPPORT):
        scene.add(role).sphere([0.0, 0.0, 0.1], 0.05)
    objects = scene.objects()
    centers, radii = np.zeros((2, 3)), np.array([0.02, 0.03])
    enlargement = np.array([0.04, 0.01])
    pairs = candidate_pairs(centers, radii + 0.1, objects)
    of_pair = enlargement[pairs.sphere_index]

    def limited(gap_m: float | None, between: bool = False) -> tuple[list[float], int]:
        mask = pairs.object_index == 0 if between else None
        found, binding = radii_for_role(radii, of_pair, pairs, objects.roles, gap_m, mask)
        return (found - radii[pairs.sphere_index]).round(12).tolist(), binding

    # Pairs are ordered by primitive, then by sphere.
    assert limited(None) == ([0.04, 0.01, 0.04, 0.01, 0.04, 0.01], 0)
    assert limited(0.2) == ([0.04, 0.01, 0.04, 0.01, 0.04, 0.01], 0)
    assert limited(0.06) == ([0.04, 0.01, 0.03, 0.01, 0.04, 0.01], 1)
    assert limited(0.0) == ([0.04, 0.01, 0.0, 0.0, 0.04, 0.01], 2)
    assert limited(0.01, between=True) == ([0.005, 0.005, 0.005, 0.005, 0.04, 0.01], 4)
    for gap in (-0.01, math.nan, math.inf):
        with pytest.raises(ValueError, match="gap_m"):
            limited(gap)


def test_an_empty_scene_costs_no_kernel_call(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("sphere_pairs", "box_pairs", "tetrahedron_pairs", "half_space_pairs"):
        monkeypatch.setattr(kernels, name, None)
    objects = Scene().add().box([9.0, 0.0, 0.0], [0.1, 0.1, 0.1]).objects()
    pairs = candidate_pairs(np.zeros((3, 3)), np.ones(3), objects)
    overlaps = by_object(evaluate(np.zeros((3, 3)), np.empty(0), objects, pairs))
    assert len(overlaps) == 0
    with pytest.raises(ValueError, match="pair_radii_m"):
        evaluate(np.zeros((3, 3)), np.ones(3), objects, pairs)
