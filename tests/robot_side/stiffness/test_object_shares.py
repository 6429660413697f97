import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.pairs.candidates import candidate_pairs
from robot_side.pairs.overlaps import by_object, evaluate, select
from robot_side.stiffness.object_shares import object_shares
from tests.helpers.perceived_scenes import random_scene


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_shares_are_the_sums_over_each_objects_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 3, 0.2)
    centers, radii = rng.uniform(-0.2, 0.2, (6, 3)), rng.uniform(0.05, 0.2, 6)
    pairs = candidate_pairs(centers, radii, objects)
    every = by_object(evaluate(centers, radii[pairs.sphere_index], objects, pairs))
    overlaps = select(every, np.flatnonzero(every.volume_m3 > 0.0))
    aligned = rng.uniform(0.0, 1.0, (2, len(overlaps)))
    reference_m3 = rng.uniform(1e-4, 1e-3, 2)
    shares = object_shares(overlaps, aligned, reference_m3)

    assert list(shares) == sorted(set(overlaps.object_index.tolist()))
    for index, share in shares.items():
        rows = overlaps.object_index == index
        along_neither = 1.0 - aligned[:, rows].max(axis=0)
        expected = [
            (aligned[0, rows] * overlaps.volume_m3[rows]).sum() / reference_m3[0],
            (aligned[1, rows] * overlaps.volume_m3[rows]).sum() / reference_m3[1],
            (along_neither * overlaps.volume_m3[rows]).sum() / reference_m3.max(),
        ]
        np.testing.assert_allclose(share, expected, rtol=1e-12)
