"""The paper's own law: D_incr as the paper has it, one total overlap, and one stiffness for both triggers."""

import dataclasses
import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from common.protocol.uniform_field import uniform_field
from common.roles import Role
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.laws.paper import PERIOD_S, REFERENCE_SHARE
from robot_side.overlap import sphere_box, sphere_sphere
from tests.helpers.field.fields import RADIUS_M, ball_pose
from tests.helpers.field.situations import (
    ACCELERATION_M_S2,
    CAMERA_SD_M,
    FULL_SPEED_M_S,
    SIGMA_M,
    Senses,
    moving,
    paper,
    situation,
    walls,
)
from tests.helpers.gripper_poses import free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene


def senses(encoder_sigma_rad: float = 0.0, **changes: Any) -> Senses:
    return Senses(paper(encoder_sigma_rad, **changes))


def ball_volume(radius_m: float) -> float:
    return 4.0 / 3.0 * math.pi * radius_m**3


def test_the_enlargement_is_as_printed() -> None:
    """D_incr has |μ_ee| + √3 |μ_c| (for equal axes), the trace of Σ, and |v| t_d, whatever the direction."""
    pose = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]], [0.01, 0.02])
    rates = np.array([0.1, 0.0, 0.2, 0.0, 1.0, 0.0])
    known = {"camera_mean_m": (-0.002,) * 3, "kinematic_mean_m": (0.001, -0.002, 0.002), "probability": 0.95}
    sensed = senses(1e-3, **known).sense(pose, joint_velocities_rad_s=rates, loop_age_s=0.2)
    variance = np.trace(position_covariance(pose.sphere_jacobians, np.full(6, 1e-3)), axis1=1, axis2=2)
    # The far sphere moves by v + ω × r.
    speeds = np.array([math.hypot(0.1, 0.2), math.hypot(0.4, 0.2)])
    spread = NormalDist().inv_cdf(0.95) * np.sqrt(variance + CAMERA_SD_M**2)
    expected = 0.2 * speeds + 0.003 + math.sqrt(3.0) * 0.002 + spread
    assert sensed.enlargement_m == pytest.approx(expected.max(), rel=1e-9)


def test_the_overlap_is_the_total_of_all_spheres_and_objects() -> None:
    pose = free_pose([[0.0, 0.0, 0.0], [0.03, 0.0, 0.0]], [0.01, 0.02])
    scene = Scene().add().box([0.0, 0.0, 0.069], [0.2, 0.2, 0.05]).add(Role.TARGET).sphere([0.06, 0.0, 0.0], 0.02)
    # The paper's law ignores the gap between the fingers.
    sensed = senses().sense(pose, scene.objects(), gap_m=0.0)
    radii = pose.sphere_radii_m + SIGMA_M
    box = np.array([[0.0, 0.0, 0.069]] * 2), np.tile(np.eye(3), (2, 1, 1)), np.array([[0.2, 0.2, 0.05]] * 2)
    with_box = sphere_box(pose.sphere_centers_m, radii, *box)
    with_ball = sphere_sphere(pose.sphere_centers_m, radii, np.array([[0.06, 0.0, 0.0]] * 2), np.full(2, 0.02))
    assert sensed.overlap_m3 == pytest.approx(float(np.sum(with_box) + np.sum(with_ball)), rel=1e-9)


def test_the_stiffness_is_its_share_of_the_enlarged_gripper_in_eighths() -> None:
    found = set()
    for gap_m in np.linspace(0.0, SIGMA_M, 60):
        pose = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, -0.2]], [RADIUS_M, 0.004])
        sensed = senses().sense(pose, walls(float(gap_m)))
        whole_m3 = ball_volume(RADIUS_M + SIGMA_M) + ball_volume(0.004 + SIGMA_M)
        share = sensed.overlap_m3 / (REFERENCE_SHARE * whole_m3)
        assert 8.0 * sensed.r2.course_stiffness == round(8.0 * min(1.0, share))
        found.add(sensed.r2.course_stiffness)
    assert found == {strength / 8.0 for strength in range(9)}
    assert REFERENCE_SHARE == 0.05


@pytest.mark.parametrize("ahead", [True, False])
def test_it_is_the_same_on_both_triggers_and_in_every_zone(ahead: bool) -> None:
    found = []
    for gap_m in np.linspace(-0.005, SIGMA_M, 30):
        objects = walls(float(gap_m)) if ahead else walls(None, float(gap_m))
        sensed = senses().sense(ball_pose(), objects)
        assert sensed.l2 == sensed.r2
        strength = round(8.0 * sensed.r2.course_stiffness)
        assert sensed.r2 == uniform_field(strength, FULL_SPEED_M_S, ACCELERATION_M_S2)
        found.append(sensed.r2.course_stiffness)
    assert found == sorted(found, reverse=True)
    assert (found[0], found[-1]) == (1.0, 0.0)
    assert len(set(found)) >= 6
    assert sensed.rumble == 0.0


def test_the_speed_is_that_along_r2() -> None:
    rates = moving(np.array([0.1, 0.0, -0.2]))
    assert senses().sense(ball_pose(), joint_velocities_rad_s=rates).speed_m_s == pytest.approx(-0.2)


def test_what_is_ignored_or_held_overlaps_nothing() -> None:
    scene = Scene().add(Role.IGNORED).add(Role.SUPPORT).box([0.0, 0.0, 0.0], [0.1, 0.1, 0.1])
    assert senses().sense(ball_pose(), scene.objects(), held=1).overlap_m3 == 0.0
    # To the paper's law a support is like any other object.
    assert senses().sense(ball_pose(), scene.objects()).r2.course_stiffness == 1.0


def test_it_looks_a_hundred_times_a_second() -> None:
    law = paper()
    here, there = walls(0.1), walls(0.0)
    for tick in range(100):
        sensed = law.sense(situation(ball_pose(), here if tick < 55 else there), 7.0 + 0.001 * tick)
        assert (sensed.overlap_m3 > 0.0) is (tick >= 60)
    assert law.summary() == {"fields": 10}
    assert PERIOD_S == 0.01


@pytest.mark.parametrize("name", ["tool_jacobian", "sphere_centers_m", "sphere_radii_m"])
def test_a_pose_that_is_not_finite_is_an_error_and_no_stiffness(name: str) -> None:
    pose = gripper_pose()
    values = getattr(pose, name).copy()
    values.reshape(-1)[-1] = math.nan
    with pytest.raises(ValueError, match=r"NaN|finite|valid"):
        senses().sense(dataclasses.replace(pose, **{name: values}), walls(0.1))
