"""The checklist before the first motion, with a simulated arm and a driver that has one fault."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.bounds import Workspace
from robot_side.arm.limits import ArmLimits
from robot_side.arm.port import Arm, ArmState
from robot_side.commissioning.arm_alone import ArmAlone
from robot_side.commissioning.checklist import Check, run_checks
from robot_side.commissioning.limits_measurement import KnownLimits
from robot_side.commissioning.procedure import VirtualPace
from robot_side.drivers.mujoco.robot_model import joint_names
from robot_side.parts import SceneParts, build_parts
from robot_side.settings import RobotSettings

BLOCK_M = 0.04


class FaultyArm(Arm):
    """Simulated arm behind a driver with faults."""

    joint_count = 6

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self.order, self.told_signs = np.arange(6), np.ones(6)
        self.period_s, self.block_m = 0.0, BLOCK_M
        self.loads_nm: FloatArray | None = None
        self._state: ArmState | None = None
        self._opening_m, self._now_s = 0.08, 0.0
        self._closing = 0.0

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        self._arm.command(self.told_signs * joint_velocity_rad_s[self.order], valid_until_s)

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        assert valid_until_s > self._now_s
        self._closing = closing

    def state(self, now_s: float) -> ArmState:
        passed_s, self._now_s = now_s - self._now_s, now_s
        self._opening_m = min(max(self._opening_m - 0.05 * passed_s * self._closing, self.block_m), 0.08)
        if self._state is None or now_s - self._state.time_s >= self.period_s - 1e-9:
            self._state = self._arm.state(now_s)
        return replace(
            self._state,
            gripper_opening_m=self._opening_m,
            gripper_holding=self._opening_m == self.block_m,
            joint_loads_nm=self.loads_nm,
        )


@pytest.fixture(scope="module")
def parts() -> SceneParts:
    return build_parts(RobotSettings(), 0, "")


def checked(
    parts: SceneParts, arm: Arm, no: Sequence[str] = (), block_m: float | None = BLOCK_M, **settings: object
) -> tuple[dict[str, Check], list[str]]:
    """Return the checks by name, and the questions; no: beginnings of questions that the person denies."""
    asked: list[str] = []

    def ask(question: str) -> bool:
        asked.append(question)
        return not question.startswith(tuple(no))

    of = RobotSettings(**settings)  # type: ignore[arg-type]
    limits = of.arm_limits.of_joints(6, *parts.limits.ends_rad)
    known, names = KnownLimits(limits, of.arm_limits, ArmLimits()), joint_names(parts.scene)[0]
    arm.state(0.0)
    one = ArmAlone(arm, parts, of, known, names, VirtualPace(), simulated=True)
    return {check.name: check for check in run_checks(one, ask, block_m)}, asked


def fresh() -> FaultyArm:
    return FaultyArm(build_parts(RobotSettings(), 0, "").arm)


@pytest.mark.long
def test_an_arm_without_faults_passes_and_ends_where_it_began(parts: SceneParts) -> None:
    arm = fresh()
    before_rad = arm.state(0.0).joint_positions_rad
    found, asked = checked(parts, arm)
    assert [name for name, check in found.items() if check.good is False] == []
    assert found["states"].said == "250 a second"
    assert found["limits"].good is None
    assert found["gripper"].said == "40.0 mm on the block of 40.0 mm, 80.0 mm open"
    assert found["joint 1 (shoulder_pan)"].said == "moved by 2.0°: the tool moves left by 19 mm"
    assert found["joint 6 (wrist_3)"].said.endswith("the tool rolls anticlockwise, seen from behind it, by 2.0°")
    assert "ahead by 550 mm, up by 200 mm of the world's origin" in asked[0]
    assert len(asked) == 1 + 6 + 1
    assert np.abs(arm.state(1e3).joint_positions_rad - before_rad).max() < 0.005


@pytest.mark.long
def test_a_wrong_sign_and_a_wrong_order_are_found_without_a_person(parts: SceneParts) -> None:
    turned, swapped = fresh(), fresh()
    turned.told_signs[2] = -1.0
    swapped.order = np.array([0, 2, 1, 3, 4, 5])
    found, asked = checked(parts, turned)
    assert [name for name, check in found.items() if check.good is False] == ["joint 3 (elbow)"]
    assert found["joint 3 (elbow)"].said.endswith("the other way")
    assert not any("elbow" in question for question in asked)
    found, _ = checked(parts, swapped)
    assert [name for name, check in found.items() if check.good is False] == [
        "joint 2 (shoulder_lift)",
        "joint 3 (elbow)",
    ]
    assert found["joint 2 (shoulder_lift)"].said == "joint 3 (elbow) moved with it, or instead"


@pytest.mark.long
def test_what_a_person_denies_is_wrong_and_the_rest_goes_on(parts: SceneParts) -> None:
    found, _ = checked(parts, fresh(), no=("by the joints", "joint 2", "Hold"))
    wrong = [name for name, check in found.items() if check.good is False]
    assert wrong == ["zero offsets", "joint 2 (shoulder_lift)"]
    assert found["gripper"].good is None  # not closed on anything


@pytest.mark.long
def test_slow_states_a_wrong_gripper_and_loads_are_said(parts: SceneParts) -> None:
    arm = fresh()
    arm.period_s, arm.block_m, arm.loads_nm = 0.06, 0.03, np.array([0.1, 8.0, 0.0, 0.0, 0.0, 0.0])
    limits = ArmLimits(velocity_rad_s=1.0, acceleration_rad_s2=4.0, latency_s=0.05, load_nm=10.0)
    box = Workspace((0.1, -0.4, 0.0), (0.7, 0.4, 0.8))
    found, _ = checked(parts, arm, arm_limits=limits, arm_workspace=box, arm_fastest_m_s=0.1)
    assert found["workspace box"].said == "from (0.1, -0.4, 0.0) m to (0.7, 0.4, 0.8) m in the world"
    assert found["speed cap"].said == "0.1 m/s"
    assert found["keep-out boxes"].good is None
    assert found["states"].good is False
    assert found["age of states"].good is None
    assert found["limits"].good is True
    assert found["loads at rest"] == Check(
        "loads at rest",
        False,
        "0.1, 8.0, 0.0, 0.0, 0.0, 0.0 N m",
        "set the tool's weight in the arm's own controller, or a greater load_nm",
    )
    assert found["gripper"].good is False
    found, _ = checked(parts, fresh(), block_m=None)
    assert found["gripper"].good is None
    assert found["loads at rest"].good is None
