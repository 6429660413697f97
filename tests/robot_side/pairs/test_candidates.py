import dataclasses
import gc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.objects.perceived import PerceivedObjects
from robot_side.objects.validity import require_valid
from robot_side.overlap import kernels
from robot_side.pairs import candidates
from robot_side.pairs.candidates import CandidatePairs, candidate_pairs
from tests.helpers.perceived_scenes import Scene, random_scene

seeds = st.integers(0, 2**32 - 1)
repeatable = settings(derandomize=True, deadline=None, max_examples=40)


def _kept(pairs: CandidatePairs, part: slice) -> set[tuple[int, int]]:
    return set(zip(pairs.sphere_index[part].tolist(), pairs.primitive_index[part].tolist(), strict=True))


@repeatable
@given(seed=seeds, of_each_kind=st.integers(0, 6), spheres=st.integers(0, 5))
def test_every_pair_that_overlaps_is_a_candidate(seed: int, of_each_kind: int, spheres: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, of_each_kind, 0.5)
    centers = rng.uniform(-0.6, 0.6, (spheres, 3))
    radii = rng.uniform(0.0, 0.2, spheres)
    pairs = candidate_pairs(centers, radii, objects)
    sphere, primitive = (
        index.ravel() for index in np.meshgrid(np.arange(spheres), np.arange(of_each_kind), indexing="ij")
    )
    c, r = centers[sphere], radii[sphere]
    all_kept = 0
    for part, owner, (volumes, _, _) in (
        (
            pairs.spheres,
            objects.sphere_object,
            kernels.sphere_pairs(c, r, objects.sphere_centers_m[primitive], objects.sphere_radii_m[primitive]),
        ),
        (
            pairs.boxes,
            objects.box_object,
            kernels.box_pairs(
                c,
                r,
                objects.box_centers_m[primitive],
                objects.box_rotations[primitive],
                objects.box_half_sizes_m[primitive],
            ),
        ),
        (
            pairs.tetrahedra,
            objects.tetrahedron_object,
            kernels.tetrahedron_pairs(c, r, objects.tetrahedron_vertices_m[primitive]),
        ),
        (
            pairs.half_spaces,
            objects.half_space_object,
            kernels.half_space_pairs(
                c, r, objects.half_space_normals[primitive], objects.half_space_offsets_m[primitive]
            ),
        ),
    ):
        touching = volumes > 0.0
        overlapping = set(zip(sphere[touching].tolist(), primitive[touching].tolist(), strict=True))
        kept = _kept(pairs, part)
        assert overlapping <= kept
        assert len(kept) == part.stop - part.start
        all_kept += len(kept)
        np.testing.assert_array_equal(pairs.object_index[part], owner[pairs.primitive_index[part]])
    assert all_kept == len(pairs)
    assert pairs.pairs_skipped == 4 * of_each_kind * spheres - all_kept


def test_far_objects_are_culled_and_counted() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.3], 0.1).add().sphere([5.0, 0.0, 0.0], 0.1)
    scene.add().box([0.0, -5.0, 0.0], [0.1, 0.1, 0.1]).add().half_space([0.0, 0.0, 1.0], -0.15)
    pairs = candidate_pairs(np.zeros((1, 3)), np.array([0.2]), scene.objects())
    assert pairs.object_index.tolist() == [0, 3]
    assert pairs.pairs_skipped == 2
    assert _kept(pairs, pairs.boxes) == set()


def test_exact_contact_is_kept() -> None:
    objects = Scene().add().sphere([0.0, 0.0, 0.3], 0.1).add().half_space([0.0, 0.0, 1.0], -0.2).objects()
    assert len(candidate_pairs(np.zeros((1, 3)), np.array([0.2]), objects)) == 2
    assert len(candidate_pairs(np.zeros((1, 3)), np.array([0.2 - 1e-6]), objects)) == 0


def test_bounds_are_worked_out_once_for_each_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[PerceivedObjects] = []

    def counting(objects: PerceivedObjects) -> None:
        seen.append(objects)
        require_valid(objects)

    monkeypatch.setattr("robot_side.pairs.candidates.require_valid", counting)
    first, second = (random_scene(np.random.default_rng(count), count) for count in (2, 8))
    centers, radii = np.zeros((2, 3)), np.full(2, 0.3)
    answers = [candidate_pairs(centers, radii, objects) for objects in (first, first, second, first, second)]
    assert [objects is first for objects in seen] == [True, False]
    np.testing.assert_array_equal(answers[0].sphere_index, answers[3].sphere_index)
    np.testing.assert_array_equal(answers[0].primitive_index, answers[3].primitive_index)
    np.testing.assert_array_equal(answers[2].primitive_index, answers[4].primitive_index)
    assert answers[0].primitive_index.tolist() != answers[2].primitive_index.tolist()


def test_bounds_do_not_outlive_their_frame() -> None:
    gc.collect()
    before = len(candidates._bounds)
    for seed in range(5):
        candidate_pairs(np.zeros((1, 3)), np.ones(1), random_scene(np.random.default_rng(seed), 1))
    gc.collect()
    assert len(candidates._bounds) == before


@pytest.mark.parametrize(
    ("centers", "radii", "named"),
    [
        (np.full((1, 3), np.nan), np.ones(1), "centers_m"),
        (np.zeros((1, 3)), np.array([np.inf]), "radii_m"),
        (np.zeros((1, 3)), np.array([-0.1]), "radii_m"),
        (np.zeros((1, 3)), np.ones(2), "radii_m"),
        (np.zeros((1, 2)), np.ones(1), "centers_m"),
    ],
)
def test_bad_gripper_spheres_are_named(centers: np.ndarray, radii: np.ndarray, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        candidate_pairs(centers, radii, random_scene(np.random.default_rng(0), 1))


@pytest.mark.parametrize(
    ("field", "factor"),
    [
        ("sphere_centers_m", np.nan),
        ("sphere_radii_m", -1.0),
        ("box_half_sizes_m", -1.0),
        ("box_rotations", 1.1),
        ("half_space_normals", 2.0),
        ("tetrahedron_vertices_m", np.inf),
        ("half_space_offsets_m", np.nan),
    ],
)
def test_bad_objects_are_named_and_never_silently_far_away(field: str, factor: float) -> None:
    objects = random_scene(np.random.default_rng(0), 2)
    broken = dataclasses.replace(objects, **{field: getattr(objects, field) * factor})
    for _ in range(2):
        with pytest.raises(ValueError, match=field):
            candidate_pairs(np.zeros((1, 3)), np.ones(1), broken)
