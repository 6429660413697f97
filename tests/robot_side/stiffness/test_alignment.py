"""Alignments: their values in the named cases, and their continuity along paths through solids."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.objects.perceived import PerceivedObjects
from robot_side.pairs.candidates import candidate_pairs
from robot_side.pairs.overlaps import Overlaps, by_object, evaluate
from robot_side.stiffness.alignment import alignments, trust
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

_RADIUS_M = 0.05
_THRESHOLD, _MARGIN = 1e-3, 0.1
_AHEAD = np.array([0.0, 0.0, 1.0])
_SIDEWAYS = np.array([1.0, 0.0, 0.0])
_OBLIQUE = np.array([0.6, 0.0, 0.8])
_MOTIONS = np.stack([_AHEAD, -_AHEAD, _SIDEWAYS, _OBLIQUE, -_OBLIQUE])


def _overlaps(centers_m: FloatArray, objects: PerceivedObjects, radius_m: float = _RADIUS_M) -> Overlaps:
    radii = np.full(len(centers_m), radius_m)
    pairs = candidate_pairs(centers_m, radii, objects)
    return by_object(evaluate(centers_m, radii[pairs.sphere_index], objects, pairs))


def _aligned(overlaps: Overlaps, motions: FloatArray = _MOTIONS) -> FloatArray:
    directions = np.repeat(motions[:, None, :], len(overlaps), axis=1)
    return alignments(overlaps, directions, trust(overlaps, _THRESHOLD), _MARGIN)


def _at(height_m: float, objects: PerceivedObjects) -> list[float]:
    """Alignments of the motions for one sphere on the z axis and one object."""
    overlaps = _overlaps(np.array([[0.0, 0.0, height_m]]), objects)
    assert len(overlaps) == 1
    return [float(value) for value in _aligned(overlaps)[:, 0]]


def test_a_plane_ahead_counts_by_the_cosine() -> None:
    wall = Scene().add().box([0.0, 0.0, 1.0], [2.0, 2.0, 1.0]).objects()
    assert _at(-0.03, wall) == pytest.approx([1.0, 0.0, 0.0, 0.8, 0.0], abs=1e-9)


def test_a_swallowed_object_counts_towards_it() -> None:
    ball = Scene().add().sphere([0.0, 0.0, 0.02], 0.005).objects()
    overlaps = _overlaps(np.zeros((1, 3)), ball)
    assert overlaps.volume_m3[0] == pytest.approx(4.0 / 3.0 * math.pi * 0.005**3)
    assert np.linalg.norm(overlaps.gradient_m2) < 1e-12
    assert _at(0.0, ball) == pytest.approx([1.0, 0.0, 0.0, 0.8, 0.0], abs=1e-9)


def test_a_swallowed_object_around_the_centre_counts_in_full_but_for_the_way_out() -> None:
    ball = Scene().add().sphere([0.0, 0.0, 0.004], 0.005).objects()
    ahead, back, sideways, oblique, _ = _at(0.0, ball)
    assert [ahead, sideways, oblique] == pytest.approx([1.0, 1.0, 1.0])
    assert back < 0.05
    central = Scene().add().sphere([0.0, 0.0, 0.0], 0.005).objects()
    assert _at(0.0, central) == pytest.approx([1.0] * 5)


@pytest.mark.parametrize("half_thickness_m", [0.0005, 0.005, 0.04])
def test_a_plate_through_the_centre_counts_in_full(half_thickness_m: float) -> None:
    plate = Scene().add().box([0.0, 0.0, 0.0], [1.0, 1.0, half_thickness_m]).objects()
    assert _at(0.0, plate) == pytest.approx([1.0] * 5, abs=1e-9)
    # Nearer to the face one came through, going back leads out, and going on does not.
    ahead, back, sideways, oblique, _ = _at(-0.7 * half_thickness_m, plate)
    assert [ahead, sideways, oblique] == pytest.approx([1.0, 1.0, 1.0])
    assert back < 0.1


def test_an_engulfed_sphere_counts_in_full_but_for_the_shortest_way_out() -> None:
    block = Scene().add().box([0.0, 0.0, 1.0], [2.0, 2.0, 1.0]).objects()
    overlaps = _overlaps(np.array([[0.0, 0.0, 0.2]]), block)
    assert overlaps.volume_m3[0] == pytest.approx(4.0 / 3.0 * math.pi * _RADIUS_M**3)
    ahead, back, sideways, oblique, out = _at(0.2, block)
    assert [ahead, sideways, oblique] == pytest.approx([1.0, 1.0, 1.0])
    assert back < 0.01
    assert out == pytest.approx(0.2, abs=0.01)


def test_a_motion_that_does_not_move_the_sphere_does_not_count() -> None:
    plate = Scene().add().box([0.0, 0.0, 0.0], [1.0, 1.0, 0.01]).objects()
    for height in (-0.03, -0.012, 0.0):
        aligned = _aligned(_overlaps(np.array([[0.0, 0.0, height]]), plate), np.zeros((1, 3)))
        assert aligned[0, 0] == 0.0


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_alignments_are_shares_and_opposite_motions_are_not_both_light_inside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    overlaps = _overlaps(rng.uniform(-0.3, 0.3, (12, 3)), random_scene(rng, 6, 0.3), 0.1)
    touching = overlaps.volume_m3 > 0.0
    motion = rng.normal(size=3)
    motion /= np.linalg.norm(motion)
    aligned = _aligned(overlaps, np.stack([motion, -motion]))[:, touching]
    assert ((aligned >= 0.0) & (aligned <= 1.0)).all()
    inside = overlaps.centre_inside[touching]
    np.testing.assert_allclose(aligned[:, inside].max(axis=0), 1.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_weak_gradients_blend_continuously_into_the_nearest_direction(sign: float) -> None:
    """Synthetic rows whose gradient fades to nothing along `ahead`, the nearest point lying `sign` ahead."""
    relative = np.linspace(0.0, 2.0 * _THRESHOLD, 2001)
    count = len(relative)
    disc = math.pi * _RADIUS_M**2
    nearest = np.tile(sign * _AHEAD, (count, 1))
    rows = Overlaps(
        np.arange(count),
        np.zeros(count, dtype=np.int64),
        np.full(count, _RADIUS_M),
        np.ones(count),
        relative[:, None] * disc * _AHEAD,
        np.full(count, 0.5 * _RADIUS_M),
        nearest,
        nearest,
        np.zeros(count, dtype=np.bool_),
    )
    ahead, back = _aligned(rows, np.stack([_AHEAD, -_AHEAD]))
    weight = np.minimum(1.0, relative / _THRESHOLD)
    np.testing.assert_allclose(ahead, weight + (1.0 - weight) * max(0.0, sign), atol=1e-12)
    np.testing.assert_allclose(back, (1.0 - weight) * max(0.0, -sign), atol=1e-12)


def _tilted(half_sizes_m: list[float], of_tetrahedra: bool = False) -> PerceivedObjects:
    rotation = random_rotation(np.random.default_rng(11))
    scene = Scene().add()
    if of_tetrahedra:
        return scene.box_of_tetrahedra(np.zeros(3), np.array(half_sizes_m), rotation).objects()
    return scene.box(np.zeros(3), half_sizes_m, rotation).objects()


_SOLIDS = {
    "thin plate": _tilted([0.6, 0.6, 0.001]),
    "plate": _tilted([0.6, 0.6, 0.01]),
    "thick plate": _tilted([0.6, 0.6, 0.08]),
    "block": _tilted([0.06, 0.06, 0.06]),
    "block of tetrahedra": _tilted([0.06, 0.06, 0.06], of_tetrahedra=True),
    "small ball": Scene().add().sphere([0.0, 0.0, 0.0], 0.006).objects(),
    "ball": Scene().add().sphere([0.0, 0.0, 0.0], 0.1).objects(),
}


@pytest.mark.parametrize("solid", list(_SOLIDS))
@pytest.mark.parametrize("offset_m", [0.0, 0.003])
def test_overlap_in_the_way_is_continuous_on_a_path_through_a_solid(solid: str, offset_m: float) -> None:
    """With eight times the steps the largest change between two becomes far smaller, so none is a jump."""
    objects = _SOLIDS[solid]
    normal = objects.box_rotations[0, :, 2] if len(objects.box_rotations) else np.array([0.48, 0.6, 0.64])
    across = np.cross(normal, [1.0, 0.0, 0.0])
    sphere_m3 = 4.0 / 3.0 * math.pi * _RADIUS_M**3
    largest = {}
    for steps in (5_000, 40_000):
        travel = np.linspace(-0.17, 0.17, steps + 1)
        centers = travel[:, None] * normal + offset_m * across
        overlaps = _overlaps(centers, objects)
        touched = np.zeros((len(_MOTIONS), steps + 1))
        touched[:, overlaps.sphere_index] = _aligned(overlaps) * overlaps.volume_m3
        assert (touched.max(axis=1) > 0.0).all()
        largest[steps] = np.abs(np.diff(touched, axis=1)).max() / sphere_m3
    assert largest[40_000] < 0.25 * largest[5_000]
    assert largest[40_000] < 0.01
