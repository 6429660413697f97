"""Where along a trigger's travel the gripper would touch the target."""

import math
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import ellipsoid_mesh
from robot_side.pairs import overlaps as overlapping
from robot_side.pairs.nearest_object import distance_to_object
from robot_side.stiffness import predicted_contact as contact
from robot_side.stiffness.predicted_contact import CONTACT_PERIOD_S, KEPT_S, ContactPredictor, ContactSettings
from tests.helpers.gripper_poses import OPENING_M, cover_gripper, free_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

FULL_SPEED_M_S, REACTION_S, LOOP_AGE_S = 0.25, 0.25, 0.15
REACH_M = FULL_SPEED_M_S * (REACTION_S + LOOP_AGE_S)
TOLERANCE = 1.1e-4 / REACH_M
RADIUS_M = 0.01


def predictor() -> ContactPredictor:
    return ContactPredictor(ContactSettings(REACTION_S), FULL_SPEED_M_S)


def predicted(pose: GripperPose, objects: PerceivedObjects, target: int = 0) -> contact.Contact:
    return predictor().predict(pose, objects, target, LOOP_AGE_S, 0.0)


def one_sphere(rotation: FloatArray | None = None) -> GripperPose:
    return free_pose([[0.0, 0.0, 0.0]], [RADIUS_M], tool_rotation=rotation)


def ahead(gap_m: float) -> PerceivedObjects:
    """A ball straight ahead of `one_sphere`, and `gap_m` off."""
    return Scene().add(Role.TARGET).sphere([0.0, 0.0, 0.02 + RADIUS_M + gap_m], 0.02).objects()


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.999])
def test_contact_is_at_the_share_of_the_horizon_that_the_gap_is(share: float) -> None:
    l2, r2 = predicted(one_sphere(), ahead(share * REACH_M))
    assert l2 is None
    assert r2 == pytest.approx(share, abs=TOLERANCE)


def test_beyond_the_horizon_there_is_none() -> None:
    assert predicted(one_sphere(), ahead(1.01 * REACH_M)) == (None, None)
    assert predicted(one_sphere(), ahead(5.0)) == (None, None)


def test_delay_and_reaction_make_the_horizon() -> None:
    gap_m = 0.03
    for loop_age_s, reaction_s in ((0.0, 0.25), (0.5, 0.25), (0.0, 0.5)):
        _, r2 = ContactPredictor(ContactSettings(reaction_s), FULL_SPEED_M_S).predict(
            one_sphere(), ahead(gap_m), 0, loop_age_s, 0.0
        )
        assert r2 == pytest.approx(gap_m / (FULL_SPEED_M_S * (loop_age_s + reaction_s)), abs=0.01)


def test_what_lies_behind_is_l2s() -> None:
    turned = np.diag([1.0, -1.0, -1.0])
    l2, r2 = predicted(one_sphere(turned), ahead(0.03))
    assert r2 is None
    assert l2 == pytest.approx(0.03 / REACH_M, abs=TOLERANCE)


def test_what_lies_beside_the_way_is_passed() -> None:
    beside = Scene().add(Role.TARGET).box([0.031, 0.0, 0.05], [0.02, 0.02, 0.02]).objects()
    assert predicted(one_sphere(), beside) == (None, None)
    in_the_way = Scene().add(Role.TARGET).box([0.029, 0.0, 0.05], [0.02, 0.02, 0.02]).objects()
    _, r2 = predicted(one_sphere(), in_the_way)
    # The edge at x = 9 mm, z = 30 mm is met by the flank of a ball of 10 mm.
    assert r2 == pytest.approx((0.03 - math.sqrt(0.01**2 - 0.009**2)) / REACH_M, abs=3e-3)


def test_a_gripper_that_touches_is_there_unless_it_slides() -> None:
    assert predicted(one_sphere(), ahead(-0.002)) == (None, 0.0)
    along = Scene().add(Role.TARGET).box([0.0299, 0.0, 0.0], [0.02, 0.02, 0.02]).objects()
    assert predicted(one_sphere(), along) == (None, None)


@pytest.mark.parametrize("seed", range(20))
def test_the_distance_is_where_the_gripper_first_touches(seed: int) -> None:
    generator = np.random.default_rng(seed)
    cover = cover_gripper(16)
    pose = free_pose(cover.centers_m, cover.radii_m, tool_rotation=random_rotation(generator))
    front_m = pose.tool_rotation @ np.array([0.0, 0.0, 0.01])
    scene = Scene().add(Role.TARGET)
    place_m = (
        pose.tool_position_m
        + front_m
        + pose.tool_rotation @ np.array([*generator.uniform(-0.06, 0.06, 2), generator.uniform(0.02, 0.08)])
    )
    rotation, half_sizes_m = random_rotation(generator), generator.uniform(0.01, 0.03, 3)
    match seed % 4:
        case 0:
            scene.box(place_m, half_sizes_m, rotation)
        case 1:
            scene.sphere(place_m, 0.02).sphere(place_m + 0.03 * rotation[0], 0.01)
        case 2:
            scene.box_of_tetrahedra(place_m, half_sizes_m, rotation)
        case 3:
            scene.mesh(Mesh(*ellipsoid_mesh(half_sizes_m, 3)[:2]), place_m, rotation)
    objects = scene.objects()
    for trigger, direction in enumerate((-pose.tool_rotation[:, 2], pose.tool_rotation[:, 2])):
        travel = predicted(pose, objects)[trigger]

        def gap_m(moved_m: float, direction: FloatArray = direction) -> float:
            return min(
                distance_to_object(objects, 0, center + moved_m * direction) - float(radius)
                for center, radius in zip(pose.sphere_centers_m, pose.sphere_radii_m, strict=True)
            )

        if gap_m(0.0) <= 1e-4:
            continue
        free_m = REACH_M if travel is None else travel * REACH_M
        steps = np.arange(0.0, free_m - 2e-4, 0.001)
        assert all(gap_m(float(step)) > 0.0 for step in steps)
        if travel is not None:
            assert gap_m(free_m) <= 2e-4


def test_no_target_is_no_contact_and_a_new_one_is_seen_at_once() -> None:
    contacts = predictor()
    objects = ahead(0.03)
    assert contacts.predict(one_sphere(), objects, None, LOOP_AGE_S, 0.0) == (None, None)
    assert contacts.predict(one_sphere(), objects, 0, LOOP_AGE_S, 0.0)[1] is not None
    assert contacts.predict(one_sphere(), objects, None, LOOP_AGE_S, 0.001) == (None, None)
    assert contacts.predict(one_sphere(), ahead(0.01), 0, LOOP_AGE_S, 0.002)[1] == pytest.approx(0.1, abs=TOLERANCE)


def test_noise_at_the_horizon_does_not_rattle() -> None:
    noise = np.random.default_rng(5).uniform(-2e-4, 2e-4, 200)
    contacts = predictor()
    seen = [
        contacts.predict(one_sphere(), ahead(REACH_M + float(n)), 0, LOOP_AGE_S, 1.001 * tick * CONTACT_PERIOD_S)[1]
        for tick, n in enumerate(noise)
    ]
    first = next(tick for tick, travel in enumerate(seen) if travel is not None)
    assert all(travel is not None for travel in seen[first:])
    # What is really gone goes after a tenth of a second.
    later_s = 1.001 * len(noise) * CONTACT_PERIOD_S
    assert contacts.predict(one_sphere(), ahead(1.0), 0, LOOP_AGE_S, later_s)[1] is not None
    assert contacts.predict(one_sphere(), ahead(1.0), 0, LOOP_AGE_S, later_s + KEPT_S + 0.01) == (None, None)


def test_far_targets_cost_no_distance_and_near_ones_are_looked_at_at_their_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked: list[int] = []
    whole = overlapping.nearest_surfaces

    def counted(*arguments: Any) -> Any:
        looked.append(1)
        return whole(*arguments)

    monkeypatch.setattr(contact, "nearest_surfaces", counted)
    contacts = predictor()
    for tick in range(10):
        assert contacts.predict(one_sphere(), ahead(0.5), 0, LOOP_AGE_S, 1.001 * tick * CONTACT_PERIOD_S) == (
            None,
            None,
        )
    assert looked == []
    assert contacts.out_of_reach == 10
    contacts, near = predictor(), ahead(0.03)
    for tick in range(100):
        contacts.predict(one_sphere(), near, 0, LOOP_AGE_S, tick * 0.001)
    # A ball straight ahead takes two looks: where it stands, and where the ball touches.
    assert 10 <= len(looked) <= 2 * 11


def test_the_open_gripper_takes_a_target_between_its_fingers() -> None:
    cover = cover_gripper(16)
    pose = free_pose(cover.centers_m, cover.radii_m)
    between = Scene().add(Role.TARGET).box([0.0, 0.0, 0.02], [0.25 * OPENING_M, 0.01, 0.03]).objects()
    l2, r2 = predicted(pose, between)
    assert l2 is None
    # It is the palm that will touch.
    palm = cover.centers_m[:, 2] < -0.07
    assert 0 < palm.sum() < len(palm)
    assert r2 is not None
    assert (l2, r2) == predicted(free_pose(cover.centers_m[palm], cover.radii_m[palm]), between)


@pytest.mark.parametrize("reaction_s", [0.0, -1.0, 5.1, math.nan])
def test_impossible_reactions(reaction_s: float) -> None:
    with pytest.raises(ValueError, match="reaction_s"):
        ContactSettings(reaction_s)
