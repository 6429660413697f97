import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.pairs.candidates import CandidatePairs, candidate_pairs
from robot_side.pairs.overlaps import evaluate, nearest_surfaces
from robot_side.pairs.touching import touching_pairs
from tests.helpers.perceived_scenes import Scene, random_scene

_KINDS = ("spheres", "boxes", "tetrahedra", "half_spaces")


def _listed(pairs: CandidatePairs) -> list[tuple[str, int, int, int]]:
    """(kind, sphere, primitive, object) of each pair."""
    rows = zip(pairs.sphere_index.tolist(), pairs.primitive_index.tolist(), pairs.object_index.tolist(), strict=True)
    kinds = [kind for kind in _KINDS for _ in range(getattr(pairs, kind).start, getattr(pairs, kind).stop)]
    return [(kind, *row) for kind, row in zip(kinds, rows, strict=True)]


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), of_each_kind=st.integers(0, 5), excluded=st.sampled_from([None, 0, 3]))
def test_what_is_left_out_overlaps_by_nothing(seed: int, of_each_kind: int, excluded: int | None) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, of_each_kind, 0.4)
    centers, radii = rng.uniform(-0.4, 0.4, (5, 3)), rng.uniform(0.01, 0.15, 5)
    pairs = candidate_pairs(centers, radii, objects)
    pair_radii = radii[pairs.sphere_index]
    nearest = nearest_surfaces(centers, objects, pairs)
    every = evaluate(centers, pair_radii, objects, pairs, nearest)
    kept, kept_nearest, kept_radii = touching_pairs(pairs, nearest, pair_radii, excluded)
    few = evaluate(centers, kept_radii, objects, kept, kept_nearest)

    wanted = every.object_index != (-1 if excluded is None else excluded)
    listed = _listed(pairs)
    overlapping = [listed[row] for row in np.flatnonzero(wanted & (every.volume_m3 > 0.0))]
    assert set(overlapping) <= set(_listed(kept)) <= {listed[row] for row in np.flatnonzero(wanted)}
    assert len(kept) == len(_listed(kept)) == len(kept_radii)
    assert few.volume_m3.sum() == pytest.approx(every.volume_m3[wanted].sum(), rel=1e-12)
    # Nothing is kept that is clearly out of reach.
    assert (kept_nearest.signed_distance_m <= kept_radii * (1.0 + 1e-8)).all()
    for row, name in enumerate(_listed(kept)):
        of_all = listed.index(name)
        assert kept_nearest.signed_distance_m[row] == nearest.signed_distance_m[of_all]
        np.testing.assert_array_equal(kept_nearest.direction[row], nearest.direction[of_all])
        np.testing.assert_array_equal(kept_nearest.deepening[row], nearest.deepening[of_all])


def test_exact_contact_is_kept_and_a_hair_more_is_not() -> None:
    objects = Scene().add().box([0.0, 0.0, 0.3], [0.1, 0.1, 0.1]).objects()
    centers = np.zeros((1, 3))
    pairs = candidate_pairs(centers, np.ones(1), objects)
    nearest = nearest_surfaces(centers, objects, pairs)
    assert len(touching_pairs(pairs, nearest, np.array([0.2]))[0]) == 1
    assert len(touching_pairs(pairs, nearest, np.array([0.2 - 1e-8]))[0]) == 0


def test_all_touching_is_passed_on_as_it_is() -> None:
    objects = Scene().add().sphere([0.0, 0.0, 0.1], 0.05).add().half_space([0.0, 0.0, 1.0], 0.0).objects()
    centers, radii = np.zeros((2, 3)), np.full(2, 0.1)
    pairs = candidate_pairs(centers, radii, objects)
    nearest = nearest_surfaces(centers, objects, pairs)
    pair_radii = radii[pairs.sphere_index]
    assert touching_pairs(pairs, nearest, pair_radii) == (pairs, nearest, pair_radii)
