import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.gripper.between_fingers import outside_share
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.pairs.candidates import CandidatePairs, candidate_pairs
from robot_side.pairs.overlaps import nearest_surfaces
from tests.helpers.gripper_poses import free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

# A palm and two fingertips that close along x; the tool's point lies between the tips.
PALM, RIGHT, LEFT = 0, 1, 2
HAND_M = np.array([[0.0, 0.0, -0.12], [0.05, 0.0, 0.0], [-0.05, 0.0, 0.0]])
RADII_M = np.full(3, 0.012)
ON_FINGER = [False, True, True]
FAR_M = 5.0
"""Enlarged by this much, every sphere is a candidate with everything."""


def shares(pose: GripperPose, objects: PerceivedObjects, reach_m: float = FAR_M) -> tuple[CandidatePairs, FloatArray]:
    pairs = candidate_pairs(pose.sphere_centers_m, pose.sphere_radii_m + reach_m, objects)
    share = outside_share(pose, objects, pairs, nearest_surfaces(pose.sphere_centers_m, objects, pairs))
    assert share is not None
    return pairs, share


def of_spheres(pose: GripperPose, objects: PerceivedObjects, index: int = 0) -> list[float]:
    """The share of each sphere's pair with the object `index`, in the spheres' order."""
    pairs, share = shares(pose, objects)
    rows = [
        np.flatnonzero((pairs.sphere_index == sphere) & (pairs.object_index == index)).item()
        for sphere in range(len(pose.sphere_radii_m))
    ]
    return [float(share[row]) for row in rows]


def hand(tool_position_m: FloatArray | None = None, tool_rotation: FloatArray | None = None) -> GripperPose:
    position = np.zeros(3) if tool_position_m is None else tool_position_m
    return free_pose(HAND_M, RADII_M, ON_FINGER, position, tool_rotation)


def ball(center_m: object, radius_m: float = 0.01, role: Role = Role.TARGET) -> PerceivedObjects:
    return Scene().add(role).sphere(np.asarray(center_m, dtype=np.float64), radius_m).objects()


def test_a_target_between_the_fingertips_counts_for_the_palm_alone() -> None:
    assert of_spheres(hand(), ball([0.0, 0.0, 0.0])) == [1.0, 0.0, 0.0]


def test_a_target_straight_across_the_gap_counts_for_neither_finger_before_it_is_at_the_tool_point() -> None:
    # Beside the tool point by more than it takes to have entered, and square to the fingers' inward direction.
    pose = free_pose(HAND_M - [0.0, 0.0, 0.04], RADII_M, ON_FINGER)
    assert of_spheres(pose, ball([0.0, 0.0, -0.04])) == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("center_m", [[0.0, 0.0, 0.3], [0.0, 0.3, 0.0], [0.0, 0.0, -0.4]])
def test_a_target_that_lies_far_ahead_or_beside_counts_in_full(center_m: list[float]) -> None:
    assert of_spheres(hand(), ball(center_m)) == [1.0, 1.0, 1.0]


def test_a_target_on_the_outside_of_a_finger_counts_for_that_finger() -> None:
    palm, right, _ = of_spheres(hand(), ball([0.09, 0.0, 0.0]))
    assert (palm, right) == (1.0, 1.0)


def test_an_obstacle_between_the_fingers_counts_in_full() -> None:
    scene = Scene().add(Role.TARGET).sphere([0.0, 0.0, 0.0], 0.01).add().sphere([0.0, 0.0, 0.0], 0.01)
    objects = scene.objects()
    assert of_spheres(hand(), objects, 0) == [1.0, 0.0, 0.0]
    assert of_spheres(hand(), objects, 1) == [1.0, 1.0, 1.0]


@pytest.mark.parametrize("role", [Role.OBSTACLE, Role.SUPPORT])
def test_without_a_target_nothing_is_left_out(role: Role) -> None:
    pose, objects = hand(), ball([0.0, 0.0, 0.0], role=role)
    pairs = candidate_pairs(pose.sphere_centers_m, pose.sphere_radii_m, objects)
    assert outside_share(pose, objects, pairs, nearest_surfaces(pose.sphere_centers_m, objects, pairs)) is None


def test_it_is_none_while_no_finger_is_near_the_target() -> None:
    # A palm alone near the target, no pair at all, and a gripper without fingers.
    for pose, objects in (
        (hand(), ball([0.0, 0.0, -0.15])),
        (hand(), ball([0.0, 0.0, 2.0])),
        (free_pose(HAND_M, RADII_M), ball([0.0, 0.0, 0.0], 0.06)),
    ):
        pairs = candidate_pairs(pose.sphere_centers_m, pose.sphere_radii_m, objects)
        assert outside_share(pose, objects, pairs, nearest_surfaces(pose.sphere_centers_m, objects, pairs)) is None


def test_the_share_falls_between_60_and_32_degrees_off_the_inward_direction() -> None:
    """The target stays where it is, 40 mm across from the right finger, while that is raised along the approach."""
    felt = []
    for degrees in (75.0, 61.0, 59.0, 45.0, 33.0, 31.0, 10.0):
        raised_m = 0.04 * np.tan(np.radians(degrees))
        pose = free_pose([[0.05, 0.0, -0.3 - raised_m]], [0.01], [True])
        # Of no size, so that the way to it is the way to its centre; far from the tool point.
        felt.append(of_spheres(pose, ball([0.01, 0.0, -0.3], 1e-6))[0])
    assert felt[:2] == [1.0, 1.0]
    assert felt[-2:] == [0.0, 0.0]
    assert 0.98 < felt[2] < 1.0
    assert 0.0 < felt[4] < 0.02
    assert felt == sorted(felt, reverse=True)


def test_the_share_falls_over_the_last_15_mm_to_the_tool_point() -> None:
    # Ahead of the tips by the angle that counts in full, but near to the point between them.
    def share(gap_m: float) -> float:
        pose = free_pose([[0.05, 0.0, -0.2]], [0.01], [True])
        return of_spheres(pose, ball([0.0, 0.0, 0.02 + gap_m], 0.02))[0]

    assert share(0.020) == 1.0
    assert share(0.015) == pytest.approx(1.0)
    assert share(0.006) == pytest.approx(0.4)
    assert share(0.0) == pytest.approx(0.0, abs=1e-12)
    assert share(-0.01) == 0.0


def test_it_is_the_same_wherever_the_gripper_is_and_points() -> None:
    random = np.random.default_rng(3)
    center = np.array([0.02, 0.01, 0.035])
    expected = of_spheres(hand(), ball(center))
    assert any(0.01 < share < 0.99 for share in expected)
    for _ in range(5):
        position, rotation = random.normal(size=3), random_rotation(random)
        moved = ball(position + rotation @ center)
        assert of_spheres(hand(position, rotation), moved) == pytest.approx(expected, abs=1e-9)


def test_a_finger_on_the_tools_axis_has_no_inside() -> None:
    pose = free_pose([[0.0, 0.0, -0.1]], [0.01], [True])
    assert of_spheres(pose, ball([0.0, 0.0, 0.1])) == [1.0]
    assert of_spheres(pose, ball([0.2, 0.0, -0.1])) == [1.0]


APPROACHES = {
    "straight": np.array([0.0, 0.0, 1.0]),
    "off the middle": np.array([0.0, 0.0, 1.0]),
    "oblique": np.array([0.3, 0.2, 0.93]),
    "from the open side": np.array([0.0, 1.0, 0.2]),
}
STARTS_M = {
    "straight": np.array([0.0, 0.0, -0.35]),
    "off the middle": np.array([0.02, 0.005, -0.35]),
    "oblique": np.array([-0.1, -0.07, -0.33]),
    "from the open side": np.array([0.0, -0.35, -0.07]),
}
TARGETS = {
    "box": Scene().add(Role.TARGET).box([0.0, 0.0, 0.0], [0.02, 0.02, 0.04]).objects(),
    "turned box": Scene()
    .add(Role.TARGET)
    .box([0.0, 0.0, 0.0], [0.02, 0.02, 0.04], random_rotation(np.random.default_rng(2)))
    .objects(),
    "ball": ball([0.0, 0.0, 0.0], 0.025),
    "two boxes": Scene()
    .add(Role.TARGET)
    .box([0.0, 0.0, 0.02], [0.02, 0.02, 0.02])
    .box([0.0, 0.0, -0.02], [0.01, 0.015, 0.02])
    .objects(),
}


@pytest.mark.parametrize("approach", list(APPROACHES))
@pytest.mark.parametrize("target", list(TARGETS))
def test_it_changes_without_a_jump_all_along_an_approach(approach: str, target: str) -> None:
    """With eight times the steps the largest change between two becomes about eight times smaller."""
    objects = TARGETS[target]
    largest = {}
    for steps in (200, 1600):
        path = STARTS_M[approach] + np.linspace(0.0, 0.4, steps + 1)[:, None] * APPROACHES[approach]
        felt = np.array([shares(gripper_pose(position), objects)[1] for position in path])
        assert felt[0].min() == 1.0
        largest[steps] = float(np.abs(np.diff(felt, axis=0)).max())
        if approach == "straight":
            assert felt.min() == 0.0
    assert 0.0 < largest[1600] < 0.2 * largest[200]
