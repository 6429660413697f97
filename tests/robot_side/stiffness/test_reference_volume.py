import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap import sphere_half_space
from robot_side.pairs.candidates import candidate_pairs
from robot_side.pairs.overlaps import evaluate
from robot_side.simulation.arm import MujocoArm
from robot_side.simulation.encoders import Encoder
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import load_scene
from robot_side.stiffness.map import StiffnessMap, StiffnessSettings
from robot_side.stiffness.reference_volume import plane_overlaps
from tests.helpers.gripper_poses import BOX_CENTERS_M, BOX_HALF_SIZES_M, cover_gripper
from tests.helpers.perceived_scenes import Scene

AHEAD = np.array([0.0, 0.0, 1.0])
ENLARGEMENTS_M = (0.001, 0.007, 0.02, 0.06, 0.25)
repeatable = settings(derandomize=True, deadline=None, max_examples=50)


def unit(vectors: FloatArray) -> FloatArray:
    result: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


def plane_ahead(direction: FloatArray, distance_m: float) -> PerceivedObjects:
    """A half-space whose surface lies square to `direction`, `distance_m` from the origin."""
    return Scene().add().half_space(-direction, -distance_m).objects()


def stiffness_towards_plane(
    centers_m: FloatArray, radii_m: FloatArray, enlargement_m: float, direction: FloatArray, distance_m: float
) -> float:
    """R2's stiffness when it leads along `direction`, and L2's the other way."""
    enlarged_m = radii_m + enlargement_m
    plane = plane_ahead(direction, distance_m)
    pairs = candidate_pairs(centers_m, enlarged_m, plane)
    moves = np.tile(direction, (len(radii_m), 1))
    reference_m3 = plane_overlaps(
        centers_m, radii_m, np.full(len(radii_m), enlargement_m), np.stack([-direction, direction])
    )
    felt = StiffnessMap(StiffnessSettings()).update(
        evaluate(centers_m, enlarged_m[pairs.sphere_index], plane, pairs),
        plane.roles,
        4.0 / 3.0 * np.pi * enlarged_m**3,
        {"l2": -moves, "r2": moves},
        0.0,
        reference_m3=reference_m3,
    )
    return felt.r2


@repeatable
@given(seed=st.integers(0, 2**32 - 1), spheres=st.integers(1, 20), directions=st.integers(1, 4))
def test_it_is_what_the_exact_overlaps_say_of_a_plane_at_the_foremost_sphere(
    seed: int, spheres: int, directions: int
) -> None:
    random = np.random.default_rng(seed)
    centers, radii = random.normal(size=(spheres, 3)) * 0.05, 10.0 ** random.uniform(-3.0, -1.0, spheres)
    # From nothing to a gripper of which whole spheres lie behind the plane.
    enlargement = 10.0 ** random.uniform(-2.99, -0.3, spheres)
    along = unit(random.normal(size=(directions, 3)))
    found = plane_overlaps(centers, radii, enlargement, along)
    assert found.shape == (directions,)
    for volume, direction in zip(found, along, strict=True):
        front = float((centers @ direction + radii).max())
        exact = sphere_half_space(
            centers, radii + enlargement, np.tile(-direction, (spheres, 1)), np.full(spheres, -front)
        )
        assert isinstance(exact, np.ndarray)
        assert volume == pytest.approx(float(exact.sum()), rel=1e-9)


def test_only_what_reaches_beyond_the_plane_counts() -> None:
    centers = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.05], [0.0, 0.0, -0.2]])
    radii = np.array([0.06, 0.005, 0.02])
    enlargement = np.array([0.01, 0.04, 0.01])
    depth, radius = 0.01, 0.07
    cap = math.pi * depth**2 * (3.0 * radius - depth) / 3.0
    # The first one touches the plane at 0.06; the second one's enlarged front is at 0.095, the third one's at -0.17.
    second_depth, second_radius = 0.035, 0.045
    second = math.pi * second_depth**2 * (3.0 * second_radius - second_depth) / 3.0
    [volume] = plane_overlaps(centers, radii, enlargement, AHEAD[None])
    assert volume == pytest.approx(cap + second)


def test_each_direction_has_its_own_plane() -> None:
    centers, radii = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.0]]), np.array([0.01, 0.05])
    both = plane_overlaps(centers, radii, np.full(2, 0.02), np.stack([AHEAD, -AHEAD]))
    small, large = (math.pi * 0.02**2 * (3.0 * radius - 0.02) / 3.0 for radius in (0.03, 0.07))
    np.testing.assert_allclose(both, [small, large])


def test_each_direction_may_have_its_own_enlargement() -> None:
    cover = cover_gripper(16)
    directions = np.stack([-AHEAD, AHEAD])
    enlargement = np.stack([np.full(len(cover.radii_m), 0.01), np.full(len(cover.radii_m), 0.05)])
    both = plane_overlaps(cover.centers_m, cover.radii_m, enlargement, directions)
    for row in range(2):
        [alone] = plane_overlaps(cover.centers_m, cover.radii_m, enlargement[row], directions[row : row + 1])
        assert both[row] == alone


def test_a_gripper_that_is_hardly_enlarged_is_taken_as_enlarged_by_a_millimetre() -> None:
    cover = cover_gripper(16)
    count = len(cover.radii_m)
    least = plane_overlaps(cover.centers_m, cover.radii_m, np.full(count, 1e-3), AHEAD[None])
    assert least[0] > 0.0
    for enlargement_m in (0.0, 1e-6, 0.9e-3):
        found = plane_overlaps(cover.centers_m, cover.radii_m, np.full(count, enlargement_m), AHEAD[None])
        np.testing.assert_array_equal(found, least)
    assert plane_overlaps(cover.centers_m, cover.radii_m, np.full(count, 1.1e-3), AHEAD[None])[0] > least[0]


@pytest.mark.parametrize("enlargement_m", ENLARGEMENTS_M)
@pytest.mark.parametrize("tilt_rad", [0.0, 0.4, math.pi])
def test_a_plane_that_the_gripper_touches_gives_full_stiffness_at_every_enlargement(
    enlargement_m: float, tilt_rad: float
) -> None:
    cover = cover_gripper(16)
    direction = np.array([math.sin(tilt_rad), 0.0, math.cos(tilt_rad)])
    front_m = float((cover.centers_m @ direction + cover.radii_m).max())
    felt = [
        stiffness_towards_plane(cover.centers_m, cover.radii_m, enlargement_m, direction, front_m + gap_m)
        for gap_m in (-1e-6, 0.0, 0.02 * enlargement_m, 0.5 * enlargement_m, enlargement_m)
    ]
    assert felt[0] == 1.0
    assert felt[1] == pytest.approx(1.0, abs=1e-9)
    assert 0.9 < felt[2] < 1.0
    assert 0.0 < felt[3] < 0.9
    assert felt[4] == pytest.approx(0.0, abs=1e-9)


def test_a_larger_enlargement_warns_earlier() -> None:
    cover = cover_gripper(16)
    front_m = float((cover.centers_m[:, 2] + cover.radii_m).max())
    felt = [
        stiffness_towards_plane(cover.centers_m, cover.radii_m, enlargement_m, AHEAD, front_m + 0.005)
        for enlargement_m in ENLARGEMENTS_M
    ]
    assert felt == sorted(felt)
    assert felt[0] == 0.0
    assert felt[-1] > 0.9


def felt_at(spheres: int, enlargement_m: float, distance_m: float) -> float:
    """R2 with a plane `distance_m` ahead of the boxes themselves, not of the spheres, which reach out farther."""
    front_m = float((BOX_CENTERS_M[:, 2] + BOX_HALF_SIZES_M[:, 2]).max())
    cover = cover_gripper(spheres)
    return stiffness_towards_plane(cover.centers_m, cover.radii_m, enlargement_m, AHEAD, front_m + distance_m)


@pytest.mark.parametrize("enlargement_m", ENLARGEMENTS_M)
def test_twice_the_default_spheres_hardly_change_what_a_plane_ahead_feels_like(enlargement_m: float) -> None:
    """Measured: at most 0.054 of the full stiffness (at 250 mm), where a share of the volume moves it by 0.33."""
    for share in np.linspace(0.0, 1.0, 11):
        coarse, fine = (felt_at(spheres, enlargement_m, float(share) * enlargement_m) for spheres in (16, 32))
        assert fine == pytest.approx(coarse, abs=0.06)
        if enlargement_m <= 0.06 and coarse > 0.05:
            assert fine == pytest.approx(coarse, rel=0.2)


@pytest.mark.parametrize("spheres", [5, 8, 16, 32, 64, 128])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_fineness_of_the_cover_feels_less_than_all_when_the_true_gripper_touches(
    spheres: int, axis: int, sign: float
) -> None:
    direction = sign * np.eye(3)[axis]
    surface_m = float((BOX_CENTERS_M @ direction + BOX_HALF_SIZES_M[:, axis]).max())
    cover = cover_gripper(spheres)
    for enlargement_m in ENLARGEMENTS_M:
        felt = stiffness_towards_plane(cover.centers_m, cover.radii_m, enlargement_m, direction, surface_m)
        assert felt == pytest.approx(1.0, abs=1e-9)


def test_the_figures_that_the_documents_give_for_a_fixed_share() -> None:
    scene = load_scene()
    pose = MujocoKinematics(scene).pose(MujocoArm(scene, Encoder()).state(0.0))
    felt = []
    for enlargement_m in (0.007, 0.03, 0.06):
        enlarged_m = pose.sphere_radii_m + enlargement_m
        enlargements = np.full(len(enlarged_m), enlargement_m)
        [touching_m3] = plane_overlaps(
            pose.sphere_centers_m, pose.sphere_radii_m, enlargements, pose.tool_rotation[None, :, 2]
        )
        felt.append(touching_m3 / (0.05 * 4.0 / 3.0 * math.pi * (enlarged_m**3).sum()))
    assert felt == pytest.approx([0.05, 0.35, 0.69], abs=0.005)
