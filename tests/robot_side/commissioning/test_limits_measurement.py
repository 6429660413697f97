"""Limits of simulated arms, measured in virtual time and compared with those that were set."""

import tomllib

import msgspec
import numpy as np
import pytest

from robot_side.arm.limits import ArmLimits, JointLimits
from robot_side.arm.port import Arm, ArmState
from robot_side.commissioning.limits_measurement import KnownLimits, Measured, measure_limits, table, toml_lines
from robot_side.commissioning.procedure import ProcedureError, VirtualPace
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings

NAMES = ("shoulder", "elbow")
OLDEST_S = 0.1


class FollowingArm(Arm):
    """Arm of two joints without latency, with the acceleration and the faults of a test."""

    joint_count = 2

    def __init__(self) -> None:
        self.now_s, self.joints_rad, self.told = 0.0, np.zeros(2), np.zeros(2)
        self.velocity_rad_s, self.acceleration_rad_s2 = np.zeros(2), np.inf
        self.follows = np.eye(2)
        self.condition: str | None = None
        self.wall_rad, self.pressed_s = np.inf, 0.0
        self.old_s, self.fails_beyond_rad = 0.0, np.inf
        self.disturbed_s, self.disturbed_share = (np.inf, np.inf), 0.0

    def command(self, joint_velocity_rad_s: np.ndarray, valid_until_s: float) -> None:
        assert valid_until_s > self.now_s
        self.told = self.follows @ joint_velocity_rad_s

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        assert closing == 0.0
        assert valid_until_s > self.now_s

    def state(self, now_s: float) -> ArmState:
        passed_s, self.now_s = now_s - self.now_s, now_s
        most = self.acceleration_rad_s2 * passed_s
        disturbed = self.disturbed_s[0] < now_s < self.disturbed_s[1]
        told = self.disturbed_share * self.told if disturbed else self.told
        self.velocity_rad_s = self.velocity_rad_s + np.clip(told - self.velocity_rad_s, -most, most)
        there_rad = self.joints_rad + passed_s * self.velocity_rad_s
        self.joints_rad = np.minimum(there_rad, self.wall_rad)
        if (there_rad > self.joints_rad).any():
            self.pressed_s += passed_s
        failing = self.joints_rad.max() > self.fails_beyond_rad
        measured_s = now_s - (self.old_s if failing else 0.0)
        condition = self.condition if failing else None
        return ArmState(measured_s, self.joints_rad, self.velocity_rad_s, np.zeros(0), 0.0, False, condition=condition)


def known(limits: JointLimits, settings: ArmLimits | None = None, driver: ArmLimits | None = None) -> KnownLimits:
    return KnownLimits(limits, settings or ArmLimits(), driver or ArmLimits())


def measured(arm: Arm, room_rad: float = 0.35, **limits: float) -> list[Measured]:
    of_joints = ArmLimits(**limits).of_joints(2)
    return list(measure_limits(arm, NAMES, known(of_joints), VirtualPace(), room_rad, OLDEST_S, lambda _: None))


@pytest.mark.long
@pytest.mark.parametrize(("disturbed_s", "share"), [((0.9, 1.3), 0.0), ((0.5, 2.0), 0.8)])
def test_one_run_that_a_busy_machine_disturbs_does_not_lower_the_speed(
    disturbed_s: tuple[float, float], share: float
) -> None:
    arm = FollowingArm()
    arm.acceleration_rad_s2, arm.disturbed_s, arm.disturbed_share = 8.0, disturbed_s, share
    response = measured(arm, velocity_rad_s=2.0)[0].response
    assert response is not None
    assert response.velocity_rad_s.at_least
    assert response.velocity_rad_s.value > 1.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("latency_s", "acceleration_rad_s2", "velocity_rad_s", "room_rad", "jerk_rad_s3"),
    [
        (0.0, 2.0, 0.5, 0.35, None),
        (0.05, 8.0, 1.0, 0.8, None),
        (0.1, 20.0, 2.0, 1.2, None),
        (0.05, 8.0, 1.0, 0.8, 80.0),
    ],
)
def test_what_is_measured_is_what_was_set(
    latency_s: float, acceleration_rad_s2: float, velocity_rad_s: float, room_rad: float, jerk_rad_s3: float | None
) -> None:
    true = ArmLimits(velocity_rad_s, acceleration_rad_s2, acceleration_rad_s2, jerk_rad_s3, latency_s)
    settings = RobotSettings(simulated_limits=true, arm_limits=ArmLimits(velocity_rad_s=2.5))
    parts = build_parts(settings, 0, "")
    names = [f"joint{j}" for j in range(6)]
    before_rad = parts.arm.state(0.0).joint_positions_rad
    of = known(parts.limits, settings.arm_limits)
    # The other joints would move the gripper into the table.
    driven = measure_limits(parts.arm, names, of, VirtualPace(), room_rad, OLDEST_S, lambda _: None, joints=(0, 5))
    found = list(driven)
    assert [one.fault for one in found[1:5]] == ["left out"] * 4
    for one in (found[0], found[5]):
        response = one.response
        assert response is not None, one.fault
        assert response.velocity_rad_s.value == pytest.approx(velocity_rad_s, rel=0.02)
        assert not response.velocity_rad_s.at_least
        assert response.acceleration_rad_s2.value == pytest.approx(acceleration_rad_s2, rel=0.06)
        assert response.deceleration_rad_s2.value == pytest.approx(acceleration_rad_s2, rel=0.06)
        assert response.latency_s == pytest.approx(latency_s, abs=0.003)
        if jerk_rad_s3 is None:
            assert response.jerk_rad_s3 is None
        else:
            assert response.jerk_rad_s3 == pytest.approx(jerk_rad_s3, rel=0.1)
        assert response.noise_rad == pytest.approx(2.1e-4, rel=0.3)
    after_rad = parts.arm.state(1e-9).joint_positions_rad
    assert np.abs(after_rad - before_rad).max() < 0.03
    lines = toml_lines(found, of)
    pasted = msgspec.convert(tomllib.loads("\n".join(lines))["arm"]["limits"], ArmLimits).of_joints(6)
    assert pasted.velocity_rad_s[[0, 5]] == pytest.approx(np.full(2, velocity_rad_s), rel=0.02)
    assert pasted.acceleration_rad_s2[[0, 5]] == pytest.approx(np.full(2, acceleration_rad_s2), rel=0.06)


def slow() -> FollowingArm:
    arm = FollowingArm()
    arm.acceleration_rad_s2 = 2.0
    return arm


def test_a_figure_that_the_room_does_not_show_is_told_as_at_least() -> None:
    small, large, fast = (
        measured(arm, room_rad)[0].response for arm, room_rad in ((slow(), 0.1), (slow(), 0.6), (FollowingArm(), 0.35))
    )
    assert small is not None
    assert large is not None
    assert fast is not None
    assert small.velocity_rad_s.at_least
    assert large.velocity_rad_s.at_least
    assert small.velocity_rad_s.value < 0.7 * large.velocity_rad_s.value < 2.0
    assert fast.velocity_rad_s.value == pytest.approx(2.0)
    assert fast.acceleration_rad_s2.at_least


def test_limits_that_somebody_knows_stay_where_they_were_not_reached() -> None:
    found, limits = measured(slow()), ArmLimits().of_joints(2)

    def pasted(of: KnownLimits) -> list[float]:
        lines = tomllib.loads("\n".join(toml_lines(found, of)))
        return list(lines["arm"]["limits"]["velocity_rad_s"])

    assert max(pasted(known(limits))) < 1.0
    assert table(found, known(limits))[1][3:] == ["2", "assumed"]
    said = ArmLimits(velocity_rad_s=2.0)
    for of, source in ((known(limits, settings=said), "the settings"), (known(limits, driver=said), "the driver")):
        assert pasted(of) == [2.0, 2.0]
        assert table(found, of)[1][3:] == ["2", source]


@pytest.mark.parametrize(
    ("follows", "fault"),
    [
        (
            np.diag([0.0, 1.0]),
            "joint 1 (shoulder) does not follow, or met something, after 0.000 rad",
        ),
        (np.diag([-1.0, 1.0]), "joint 1 (shoulder) moves the other way than it is commanded"),
        (np.array([[0.5, 0.0], [1.0, 1.0]]), "joint 2 (elbow) moves while joint 1 (shoulder) is commanded"),
    ],
)
def test_a_joint_that_does_not_follow_ends_with_a_line_and_the_next_begins(follows: np.ndarray, fault: str) -> None:
    arm = FollowingArm()
    arm.follows = follows
    first, second = measured(arm)
    assert (first.response, first.fault) == (None, fault)
    assert second.response is not None
    assert not arm.told.any()


def test_a_joint_that_meets_something_does_not_press_on() -> None:
    arm = FollowingArm()
    arm.wall_rad = 0.12
    first, second = measured(arm)
    assert first.response is None
    assert first.fault is not None
    assert first.fault.startswith("joint 1 (shoulder) does not follow, or met something, after 0.1")
    assert second.response is None
    assert arm.pressed_s < 2 * (0.25 + 0.1)  # without progress, and since the last progress that counts


def test_a_joint_at_the_end_of_its_range_goes_the_other_way_or_is_left_out() -> None:
    arm, limits = FollowingArm(), ArmLimits().of_joints(2, np.array([-0.05, -0.05]), np.array([1.0, 0.06]))
    lowest, beyond = 0.0, np.zeros(2)

    class Watched(VirtualPace):
        def wait(self) -> float:
            nonlocal lowest, beyond
            lowest, beyond = min(lowest, float(arm.joints_rad[0])), np.maximum(beyond, arm.joints_rad)
            return super().wait()

    first, second = measure_limits(arm, NAMES, known(limits), Watched(), 0.35, OLDEST_S, lambda _: None)
    assert first.response is not None
    assert lowest > -0.05
    assert 0.2 < beyond[0] < 0.35
    assert second.fault is not None
    assert "to the ends of its range" in second.fault


@pytest.mark.parametrize(
    ("condition", "old_s", "told"), [("a fault: hot", 0.0, "a fault: hot"), (None, 0.2, "the arm is lost")]
)
def test_a_failing_state_stops_the_arm(condition: str | None, old_s: float, told: str) -> None:
    arm = FollowingArm()
    arm.condition, arm.old_s, arm.fails_beyond_rad = condition, old_s, 0.1
    with pytest.raises(ProcedureError, match=told):
        measured(arm)
    assert not arm.told.any()
    assert arm.joints_rad.max() < 0.12


def test_a_person_stops_the_arm() -> None:
    arm = FollowingArm()

    class Stopped(VirtualPace):
        @property
        def stopped(self) -> bool:  # type: ignore[override]
            return bool(arm.joints_rad.max() > 0.05)

    with pytest.raises(ProcedureError, match="ended by a person"):
        list(measure_limits(arm, NAMES, known(ArmLimits().of_joints(2)), Stopped(), 0.35, OLDEST_S, lambda _: None))
    assert not arm.told.any()
    assert arm.joints_rad.max() < 0.06
