import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.enlargement.distance import Enlargement, EnlargementSettings
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.gripper.held_object import grip, with_held
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.overlap import kernels
from robot_side.sensing import AheadSensing, Sensed
from robot_side.stiffness.map import StiffnessMap, StiffnessSettings
from tests.helpers import nearest_point
from tests.helpers.gripper_poses import OPENING_M, free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

Direction = Literal["isotropic", "towards_object"]
DIRECTIONS: tuple[Direction, Direction] = ("isotropic", "towards_object")
STILL = np.zeros(6)
SIGMA = np.array([1e-3, 2e-3, 3e-3, 4e-3, 2e-3, 1e-3])
"""Of the free tool's six joints: metres for the first three, radians for the others."""
FASTER_THAN_ANY_RATE_LIMIT_S = 10.0


class Senses:
    """A sensing pipeline with settings that a test names, and time that passes with each use."""

    def __init__(self, direction: Direction = "isotropic", probability: float = 0.99, **stiffness: Any) -> None:
        self.ahead = AheadSensing(
            Enlargement(EnlargementSettings(probability, camera_sd_m=0.003, direction=direction)),
            StiffnessMap(StiffnessSettings(**stiffness)),
            SIGMA,
        )
        self.now_s = 0.0

    def sense(
        self,
        pose: GripperPose,
        objects: PerceivedObjects,
        velocity: FloatArray = STILL,
        loop_age_s: float = 0.1,
        gap_m: float | None = OPENING_M,
        excluded: int | None = None,
    ) -> Sensed:
        self.now_s += FASTER_THAN_ANY_RATE_LIMIT_S
        return self.ahead.sense(pose, velocity, objects, loop_age_s, gap_m, excluded, self.now_s)


def wall_ahead(pose: GripperPose, gap_m: float, role: Role = Role.OBSTACLE) -> PerceivedObjects:
    """A plane square to the approach, `gap_m` ahead of the foremost unenlarged sphere."""
    approach = pose.tool_rotation[:, 2]
    front_m = float((pose.sphere_centers_m @ approach + pose.sphere_radii_m).max())
    return Scene().add(role).half_space(-approach, -(front_m + gap_m)).objects()


# What is felt


def test_what_is_ahead_is_felt_on_r2_and_what_is_behind_on_l2() -> None:
    pose = gripper_pose([0.3, 0.1, 0.2], random_rotation(np.random.default_rng(4)))
    ahead = Senses().sense(pose, wall_ahead(pose, 0.004))
    assert 0.1 < ahead.stiffness.r2 < 1.0
    assert ahead.stiffness.l2 == 0.0
    assert ahead.overlap_m3 > 0.0
    approach = pose.tool_rotation[:, 2]
    back_m = float((pose.sphere_centers_m @ approach - pose.sphere_radii_m).min())
    behind = Senses().sense(pose, Scene().add().half_space(approach, back_m - 0.004).objects())
    assert 0.1 < behind.stiffness.l2 < 1.0
    assert behind.stiffness.r2 == 0.0


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize(
    "velocity",
    [STILL, np.array([0.0, 0.0, 0.25, 0.0, 0.0, 0.0]), np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]), -0.2 * np.ones(6)],
    ids=["still", "ahead", "sideways", "back and turning"],
)
def test_a_plane_that_the_gripper_touches_is_felt_in_full_however_it_moves(
    direction: Direction, velocity: FloatArray
) -> None:
    pose = gripper_pose()
    felt = Senses(direction).sense(pose, wall_ahead(pose, 0.0), velocity, 0.5)
    assert felt.stiffness.r2 == pytest.approx(1.0, abs=1e-6)


def test_delay_and_speed_warn_earlier() -> None:
    pose = gripper_pose()
    wall = wall_ahead(pose, 0.02)
    ahead = np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    felt = [
        Senses().sense(pose, wall, velocity, loop_age_s).stiffness.r2
        for velocity, loop_age_s in ((STILL, 2.0), (ahead, 0.1), (ahead, 0.2), (2.0 * ahead, 0.2), (2.0 * ahead, 0.5))
    ]
    assert felt[0] == 0.0
    assert felt[1:] == sorted(set(felt[1:]))


def test_the_enlargement_is_eq_10_for_each_sphere() -> None:
    pose = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]], [0.01, 0.02])
    turning = np.array([0.1, 0.0, 0.0, 0.0, 1.0, 0.0])
    sensed = Senses().sense(pose, Scene().objects(), turning, 0.2)
    # The far sphere moves by v + ω × r: 0.1 + 1 rad/s times 0.3 m along x.
    variance = np.array([3e-3**2, (1e-3) ** 2 + (0.3 * 2e-3) ** 2])
    across = np.array([0.0, (2e-3) ** 2 + (0.3 * 4e-3) ** 2])
    spread = np.sqrt(np.maximum(np.maximum(variance, across), 3e-3**2) + 0.003**2)
    expected = 0.2 * np.array([0.1, 0.4]) + 2.3263478740408408 * spread
    np.testing.assert_allclose(sensed.enlargement_m, expected, rtol=1e-9)


# What a scene does not need


def test_nothing_near_costs_neither_distance_nor_overlap(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_use(*_: Any) -> Any:
        raise AssertionError("a kernel was called although nothing is near")

    for kind in ("sphere", "box", "tetrahedron", "half_space"):
        monkeypatch.setattr(kernels, f"{kind}_pairs", no_use)
        monkeypatch.setattr(nearest_point, f"nearest_on_{kind}", no_use)
    far = random_scene(np.random.default_rng(1), 5, 0.2)
    away = gripper_pose([50.0, 50.0, 50.0])
    planes_behind = replace(
        far, half_space_normals=np.tile([1.0, 0.0, 0.0], (5, 1)), half_space_offsets_m=np.linspace(0.0, 1.0, 5)
    )
    senses = Senses()
    for ticks in (1, 2):
        sensed = senses.sense(away, planes_behind)
        assert sensed.overlap_m3 == 0.0
        assert (sensed.stiffness.l2, sensed.stiffness.r2, sensed.stiffness.rumble) == (0.0, 0.0, 0.0)
        assert senses.ahead.skipped.ticks_without_candidates == ticks
        assert senses.ahead.skipped.pairs_culled == ticks * 16 * 20
    with pytest.raises(AssertionError, match="a kernel was called"):
        senses.sense(gripper_pose(), far)


def test_the_counters_add_up_over_the_run() -> None:
    pose = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [0.05, 0.05])
    objects = Scene().add().sphere([0.0, 0.0, -0.1], 0.06).add().sphere([0.0, 0.0, 5.0], 0.06).objects()
    senses = Senses()
    for ticks in (1, 2, 3):
        senses.sense(pose, objects)
        assert senses.ahead.skipped.pairs_culled == 3 * ticks
        assert senses.ahead.skipped.ticks_without_candidates == 0


def test_an_empty_world_is_no_danger() -> None:
    senses = Senses()
    sensed = senses.sense(gripper_pose(), Scene().objects())
    assert sensed.overlap_m3 == 0.0
    assert sensed.stiffness.r2 == 0.0
    assert senses.ahead.skipped.ticks_without_candidates == 1


# Roles, fingers and the held object


def test_a_limit_to_half_the_gap_is_counted_towards_the_target_only() -> None:
    pose = gripper_pose()
    fast = np.array([0.0, 0.0, 0.25, 0.0, 0.0, 0.0])
    for role, limited in ((Role.TARGET, True), (Role.OBSTACLE, False)):
        senses = Senses()
        senses.sense(pose, wall_ahead(pose, 0.01, role), fast, 0.5)
        assert (senses.ahead.skipped.enlargement_limits > 0) is limited
        without_gripper = Senses()
        without_gripper.sense(pose, wall_ahead(pose, 0.01, role), fast, 0.5, gap_m=None)
        assert without_gripper.ahead.skipped.enlargement_limits == 0


def test_a_target_between_the_fingers_is_felt_by_neither_finger() -> None:
    fingers = free_pose([[0.05, 0.0, 0.0], [-0.05, 0.0, 0.0]], [0.012, 0.012], [True, True])
    for role in (Role.TARGET, Role.OBSTACLE):
        between = Scene().add(role).box([0.0, 0.0, 0.0], [0.036, 0.02, 0.02]).objects()
        sensed = Senses().sense(fingers, between)
        felt = sensed.stiffness.l2 + sensed.stiffness.r2 + sensed.stiffness.rumble
        assert (felt == 0.0) is (role is Role.TARGET)
        assert (sensed.overlap_m3 == 0.0) is (role is Role.TARGET)


def test_the_held_object_is_no_danger_to_what_holds_it() -> None:
    pose = gripper_pose()
    scene = Scene().add(Role.TARGET).box([0.0, 0.0, 0.0], [0.03, 0.02, 0.03])
    objects = scene.objects()
    whole = with_held(pose, grip(objects, 0, pose))
    carried = Senses().sense(whole, objects, excluded=0)
    assert (carried.stiffness.l2, carried.stiffness.r2, carried.stiffness.rumble) == (0.0, 0.0, 0.0)
    assert carried.overlap_m3 == 0.0
    assert Senses().sense(whole, objects).overlap_m3 > 0.0


def test_what_the_held_object_comes_near_is_felt() -> None:
    """A rod that sticks out ahead by more than the fingers meets a wall that these are far from."""
    pose = gripper_pose()
    scene = Scene().add(Role.TARGET).box([0.0, 0.0, 0.08], [0.01, 0.01, 0.1])
    with_wall = scene.add().half_space([0.0, 0.0, -1.0], -0.185).objects()
    whole = with_held(pose, grip(with_wall, 0, pose))
    carried = Senses().sense(whole, with_wall, excluded=0)
    assert carried.stiffness.r2 > 0.3
    assert carried.overlap_m3 > 0.0
    assert Senses().sense(pose, with_wall, excluded=0).stiffness.r2 == 0.0


# The two directions of the enlargement


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("probability", [0.5, 0.9, 0.999])
def test_towards_an_object_the_enlargement_is_at_most_the_isotropic_one(seed: int, probability: float) -> None:
    random = np.random.default_rng(seed)
    rotation = random_rotation(random)
    pose = gripper_pose(random.uniform(-0.2, 0.2, 3), rotation)
    velocity, loop_age_s = random.normal(size=6) * 0.2, float(random.uniform(0.0, 0.5))
    enlargement = Senses("towards_object", probability).ahead.enlargement
    covariances = position_covariance(pose.sphere_jacobians, SIGMA)
    velocities = pose.sphere_jacobians @ velocity
    directions = random.normal(size=(16, 50, 3))
    directions /= np.linalg.norm(directions, axis=2)[:, :, None]
    everywhere_m = enlargement.distances(covariances, velocities, loop_age_s)
    towards_m = enlargement.distances_towards(covariances, velocities, loop_age_s, directions)
    assert (towards_m <= everywhere_m[:, None] * (1.0 + 1e-12)).all()
    assert (towards_m < 0.99 * everywhere_m[:, None]).any()

    objects = random_scene(random, 3, 0.3)
    isotropic, towards = (
        Senses(direction, probability).sense(pose, objects, velocity, loop_age_s) for direction in DIRECTIONS
    )
    np.testing.assert_array_equal(towards.enlargement_m, isotropic.enlargement_m)
    assert 0.0 < towards.overlap_m3 <= isotropic.overlap_m3 * (1.0 + 1e-12)


def test_towards_an_object_that_one_moves_away_from_delay_does_not_count() -> None:
    pose = gripper_pose()
    wall = wall_ahead(pose, 0.03)
    back = np.array([0.0, 0.0, -0.25, 0.0, 0.0, 0.0])
    assert Senses("isotropic").sense(pose, wall, back, 0.5).overlap_m3 > 0.0
    assert Senses("towards_object").sense(pose, wall, back, 0.5).overlap_m3 == 0.0
    assert Senses("towards_object").sense(pose, wall, -back, 0.5).overlap_m3 > 0.0


def test_a_share_of_the_volume_is_the_other_reference() -> None:
    pose = free_pose([[0.0, 0.0, 0.0]], [0.05])
    sensed = Senses(reference="fraction", reference_fraction=0.5).sense(pose, wall_ahead(pose, 0.0), gap_m=None)
    enlarged_m = 0.05 + float(sensed.enlargement_m[0])
    volume_m3 = 4.0 / 3.0 * math.pi * enlarged_m**3
    assert sensed.stiffness.r2 == pytest.approx(sensed.overlap_m3 / (0.5 * volume_m3))
