"""The paper's own law: D_incr as the paper has it, and its stiffness, directed and as printed."""

import dataclasses
import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from common.protocol.uniform_field import uniform_field
from common.roles import Role
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.laws.paper import PERIOD_S, PaperLaw
from robot_side.laws.paper_settings import EnlargementTime, PaperSettings
from robot_side.overlap import sphere_box, sphere_sphere
from robot_side.tick.sensed import Sensed
from tests.helpers.field.fields import RADIUS_M, ball_pose
from tests.helpers.field.situations import (
    ACCELERATION_M_S2,
    CAMERA_SD_M,
    FULL_SPEED_M_S,
    SIGMA_M,
    Senses,
    inputs,
    moving,
    paper,
    situation,
    walls,
)
from tests.helpers.gripper_poses import free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene

SHARE = 0.05
"""f with which one sphere's stiffness goes through all eighths within D_incr"""


def senses(
    encoder_sigma_rad: float = 0.0,
    share: float = SHARE,
    enlargement: EnlargementTime = "always",
    *,
    isotropic: bool = False,
    **changes: Any,
) -> Senses:
    settings = PaperSettings(share, enlargement)
    return Senses(paper(encoder_sigma_rad, settings, isotropic=isotropic, **changes))


def ball_volume(radius_m: float) -> float:
    return 4.0 / 3.0 * math.pi * radius_m**3


def test_the_enlargement_is_as_printed() -> None:
    """D_incr has |μ_ee| + √3 |μ_c| (for equal axes), the trace of Σ, and |v| t_d, whatever the direction."""
    pose = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]], [0.01, 0.02])
    rates = np.array([0.1, 0.0, 0.2, 0.0, 1.0, 0.0])
    known: dict[str, Any] = {
        "camera_mean_m": (-0.002,) * 3,
        "kinematic_mean_m": (0.001, -0.002, 0.002),
        "probability": 0.95,
    }
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
    found = inputs().total_overlap_m3(situation(pose, scene.objects()), SIGMA_M)
    radii = pose.sphere_radii_m + SIGMA_M
    box = np.array([[0.0, 0.0, 0.069]] * 2), np.tile(np.eye(3), (2, 1, 1)), np.array([[0.2, 0.2, 0.05]] * 2)
    with_box = sphere_box(pose.sphere_centers_m, radii, *box)
    with_ball = sphere_sphere(pose.sphere_centers_m, radii, np.array([[0.06, 0.0, 0.0]] * 2), np.full(2, 0.02))
    assert found == pytest.approx(float(np.sum(with_box) + np.sum(with_ball)), rel=1e-9)


def test_the_stiffness_is_its_share_of_the_enlarged_gripper_in_eighths() -> None:
    found = set()
    for gap_m in np.linspace(0.0, SIGMA_M, 60):
        pose = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, -0.2]], [RADIUS_M, 0.004])
        sensed = senses(isotropic=True).sense(pose, walls(float(gap_m)))
        total_m3 = inputs().total_overlap_m3(situation(pose, walls(float(gap_m))), SIGMA_M)
        whole_m3 = ball_volume(RADIUS_M + SIGMA_M) + ball_volume(0.004 + SIGMA_M)
        share = total_m3 / (SHARE * whole_m3)
        assert 8.0 * sensed.r2.course_stiffness == round(8.0 * min(1.0, share))
        found.add(sensed.r2.course_stiffness)
    assert found == {strength / 8.0 for strength in range(9)}


@pytest.mark.parametrize("ahead", [True, False])
def test_as_printed_it_is_the_same_on_both_triggers_and_in_every_zone(ahead: bool) -> None:
    found = []
    for gap_m in np.linspace(-0.005, SIGMA_M, 30):
        objects = walls(float(gap_m)) if ahead else walls(None, float(gap_m))
        sensed = senses(isotropic=True).sense(ball_pose(), objects)
        assert sensed.l2 == sensed.r2
        strength = round(8.0 * sensed.r2.course_stiffness)
        assert sensed.r2 == uniform_field(strength, FULL_SPEED_M_S, ACCELERATION_M_S2)
        found.append(sensed.r2.course_stiffness)
    assert found == sorted(found, reverse=True)
    assert (found[0], found[-1]) == (1.0, 0.0)
    assert len(set(found)) >= 6
    assert sensed.rumble == 0.0


def stiffness(sensed: Sensed) -> tuple[float, float]:
    return sensed.l2.course_stiffness, sensed.r2.course_stiffness


@pytest.mark.parametrize("share", [0.05, 0.001])
def test_r2_stiffens_before_what_lies_ahead_and_l2_before_what_lies_behind(share: float) -> None:
    found = []
    for gap_m in np.linspace(-0.005, SIGMA_M, 30):
        law, printed = senses(share=share), senses(share=share, isotropic=True)
        l2, r2 = stiffness(law.sense(ball_pose(), walls(float(gap_m))))
        # A wall straight ahead: all of the overlap, as printed.
        assert (l2, r2) == (0.0, stiffness(printed.sense(ball_pose(), walls(float(gap_m))))[1])
        assert stiffness(law.sense(ball_pose(), walls(None, float(gap_m)))) == (r2, 0.0)
        assert stiffness(law.sense(ball_pose(), walls(float(gap_m), float(gap_m)))) == (r2, r2)
        found.append(r2)
    assert found == sorted(found, reverse=True)
    assert (found[0], found[-1]) == (1.0, 0.0)


def test_what_lies_beside_counts_for_neither_trigger() -> None:
    beside = Scene().add().box([RADIUS_M + 0.05, 0.0, 0.0], [0.05, 0.5, 0.5]).objects()
    assert stiffness(senses(share=1e-5).sense(ball_pose(), beside)) == (0.0, 0.0)
    assert stiffness(senses(share=1e-5, isotropic=True).sense(ball_pose(), beside)) == (1.0, 1.0)


_OF_A_BALL = 0.1
"""f at which a ball that is overlapped by some millimetres gives some eighths"""


@pytest.mark.parametrize(("gap_m", "limit_m"), [(0.008, 0.004), (0.1, SIGMA_M), (None, SIGMA_M)])
def test_towards_the_target_a_fingers_sphere_grows_by_half_the_gap_at_most(gap_m: float | None, limit_m: float) -> None:
    pose = dataclasses.replace(ball_pose(), sphere_on_finger=np.array([True]))
    for role, grows_by_m in ((Role.TARGET, limit_m), (Role.OBSTACLE, SIGMA_M)):
        ahead = Scene().add(role).sphere([0.0, 0.0, RADIUS_M + 0.021], 0.02).objects()
        law = paper(settings=PaperSettings(_OF_A_BALL))
        sensed = Senses(law).sense(pose, ahead, gap_m=gap_m)
        ball = np.array([[0.0, 0.0, RADIUS_M + 0.021]]), np.array([0.02])
        overlap_m3 = sphere_sphere(pose.sphere_centers_m, np.array([RADIUS_M + grows_by_m]), *ball)[0]
        strength = round(8.0 * overlap_m3 / (_OF_A_BALL * ball_volume(RADIUS_M + SIGMA_M)))
        assert stiffness(sensed) == (0.0, strength / 8.0)
        assert 0 < strength < 8
        assert law.summary()["limited_by_gap"] == (grows_by_m < SIGMA_M)


def test_once_d_incr_is_that_of_the_first_look_with_a_measured_loop_age_at_full_speed() -> None:
    law, fast = senses(enlargement="once"), moving(np.array([0.0, 0.0, 0.2]))
    assumed = law.sense(ball_pose(), loop_age_s=1.0, loop_age_settled=False)
    assert assumed.enlargement_m == pytest.approx(FULL_SPEED_M_S + SIGMA_M)
    for loop_age_s in (0.1, 0.4, 0.0):
        sensed = law.sense(ball_pose(), joint_velocities_rad_s=fast, loop_age_s=loop_age_s)
        assert sensed.enlargement_m == pytest.approx(0.1 * FULL_SPEED_M_S + SIGMA_M)
    # A held object brings more spheres; all have the same distance.
    more = free_pose([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]], [0.01, 0.02])
    assert law.sense(more, loop_age_s=0.4).enlargement_m == sensed.enlargement_m
    made = law.law
    assert isinstance(made, PaperLaw)
    made.expect(0.5)
    assert law.sense(ball_pose(), loop_age_s=0.4).enlargement_m == pytest.approx(0.4 * FULL_SPEED_M_S)


def test_the_speed_is_that_along_r2() -> None:
    rates = moving(np.array([0.1, 0.0, -0.2]))
    assert senses().sense(ball_pose(), joint_velocities_rad_s=rates).speed_m_s == pytest.approx(-0.2)


def test_what_is_ignored_or_held_overlaps_nothing() -> None:
    scene = Scene().add(Role.IGNORED).add(Role.SUPPORT).box([0.0, 0.0, 0.0], [0.1, 0.1, 0.1])
    assert senses().sense(ball_pose(), scene.objects(), held=1).r2.course_stiffness == 0.0
    # To the paper's law a support is like any other object.
    assert senses().sense(ball_pose(), scene.objects()).r2.course_stiffness == 1.0


def test_it_looks_a_hundred_times_a_second() -> None:
    law = paper()
    here, there = walls(0.1), walls(0.0)
    for tick in range(100):
        sensed = law.sense(situation(ball_pose(), here if tick < 55 else there), 7.0 + 0.001 * tick)
        assert (sensed.r2.course_stiffness > 0.0) is (tick >= 60)
    assert law.summary() == {"looks": 10, "limited_by_gap": 0}
    assert PERIOD_S == 0.01


@pytest.mark.parametrize("name", ["tool_jacobian", "sphere_centers_m", "sphere_radii_m"])
def test_a_pose_that_is_not_finite_is_an_error_and_no_stiffness(name: str) -> None:
    pose = gripper_pose()
    values = getattr(pose, name).copy()
    values.reshape(-1)[-1] = math.nan
    with pytest.raises(ValueError, match=r"NaN|finite|valid"):
        senses().sense(dataclasses.replace(pose, **{name: values}), walls(0.1))
