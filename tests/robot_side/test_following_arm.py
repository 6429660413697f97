"""An arm that does not follow, in the whole robot side: said by name, counted, felt in D_σ, and stopped if need be."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from common.arrays import FloatArray
from robot_side.arm.port import ArmState
from robot_side.parts import SceneParts, build_parts
from robot_side.settings import RobotSettings
from tests.helpers.repository import ROOT
from tests.robot_side.passed_on_arm import PassedOnArm
from tests.robot_side.session_bench import QUICK, TICK_S, Bench, Operator

ELBOW = "joint 3 (elbow)"


class Unlike(PassedOnArm):
    """Arm that is commanded otherwise than it is told, and may not measure its loads."""

    does: Callable[[FloatArray], FloatArray | None] = staticmethod(lambda told: told)
    blind = False
    longer_s = 0.0

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        if (told := self.does(joint_velocity_rad_s)) is not None:
            self.arm.command(told, valid_until_s + self.longer_s)

    def state(self, now_s: float) -> ArmState:
        state = self.arm.state(now_s)
        return replace(state, joint_loads_nm=None) if self.blind else state


def armed(spoil: Callable[[SceneParts, Unlike], object], settings: RobotSettings = QUICK) -> tuple[Bench, Operator]:
    parts = build_parts(settings, 1, "clock")
    arm = Unlike(parts.arm)
    bench = Bench(parts=replace(parts, arm=arm))
    operator = bench.join(2)
    bench.arm_it(operator)
    spoil(parts, arm)
    return bench, operator


def nothing(_: SceneParts, __: Unlike) -> None:
    pass


def servo_off(parts: SceneParts, _: Unlike) -> None:
    actuator = int(parts.scene.robot.drives.place[2])
    parts.scene.model.actuator_gainprm[actuator] = parts.scene.model.actuator_biasprm[actuator] = 0.0


def brake(parts: SceneParts, _: Unlike) -> None:
    parts.scene.model.dof_damping[parts.scene.robot.arm_velocities[2]] = 1e5
    parts.scene.model.dof_frictionloss[parts.scene.robot.arm_velocities[2]] = 1e4


def drop_all(_: SceneParts, arm: Unlike) -> None:
    arm.does = lambda _: None


def turn_round(_: SceneParts, arm: Unlike) -> None:
    arm.does = lambda told: told * [1, 1, -1, 1, 1, 1]


@pytest.mark.parametrize("blind", [False, True])
@pytest.mark.parametrize(
    ("spoil", "says"),
    # Without torque the elbow swings along.
    [
        (servo_off, "too slowly"),
        (brake, f"{ELBOW} does not move"),
        (drop_all, "do not move"),
        (turn_round, "otherwise"),
    ],
)
def test_it_is_said_by_name_within_half_a_second_and_counts_or_stops_the_arm(
    spoil: Callable[[SceneParts, Unlike], object], says: str, blind: bool
) -> None:
    bench, operator = armed(spoil)
    bench.arm.blind = blind  # type: ignore[attr-defined]
    bench.drive(0.5, operator, r2=0.6)
    assert says in str(bench.robot.status(bench.now_s).hindrance)
    assert says in str(bench.views[-1].hindrance)
    assert operator.updates[-1].hindered
    assert bench.robot.newest is not None
    assert bench.robot.newest[1].astray_m_s > 0.02
    if spoil is servo_off:
        return
    bench.drive(2.5, operator, r2=0.6)
    assert bench.state == "disarmed"
    because = str(bench.robot.status(bench.now_s).stopped_because)
    assert because.startswith("the arm does not follow: ")
    assert operator.notice is not None
    assert operator.notice.why == because
    assert ELBOW in because
    summary = bench.robot.summary()
    assert summary["following"]["noticed"][ELBOW] >= 1
    assert [stop["reason"] for stop in summary["stops"]] == [because]


def test_an_arm_that_moves_before_it_is_armed_cannot_be_armed() -> None:
    parts = build_parts(QUICK, 1, "clock")
    arm = Unlike(parts.arm)
    arm.does, arm.longer_s = lambda told: told + 0.15, 0.1
    bench = Bench(parts=replace(parts, arm=arm))
    operator = bench.join(2)
    bench.drive(0.6, operator)
    with pytest.raises(RuntimeError, match="disarmed"):
        bench.arm_it(operator)
    assert "otherwise than commanded" in str(bench.robot.status(bench.now_s).hindrance)


def halve(_: SceneParts, arm: Unlike) -> None:
    arm.does = lambda told: 0.5 * told


def test_what_it_does_not_follow_counts_in_d_sigma() -> None:
    found = []
    for spoil in (nothing, halve):
        bench, operator = armed(spoil)
        for fields in ({"r2": 0.6}, {}):
            bench.drive(1.0, operator, **fields)
            assert bench.state == "armed"
            assert bench.robot.newest is not None
            sensed, situation = bench.robot.newest
            sigma_m = bench.robot.parts.law.explain("r2", situation, sensed).sigma_m  # type: ignore[attr-defined]
            found.append((sigma_m, bench.robot.status(bench.now_s).hindrance))
    (followed_m, _), (stood_m, _), (slow_m, says), (stands_m, says_nothing) = found
    assert "too slowly" in str(says)
    assert says_nothing is None
    # Half of 0.15 m/s, for the loop age and the time in which the tool stops from its full speed.
    assert slow_m > followed_m + 0.005
    assert stands_m == pytest.approx(stood_m, abs=1e-3)


@pytest.mark.parametrize("blind", [False, True])
def test_pressing_on_a_wall_is_said_and_stops_nothing(blind: bool) -> None:
    model = Path(ROOT / "tests" / "data" / "wall.xml")
    bench, operator = armed(nothing, replace(QUICK, model=model, site="tool"))
    bench.arm.blind = blind  # type: ignore[attr-defined]
    bench.drive(3.0, operator, r2=0.6)
    says = str(bench.robot.status(bench.now_s).hindrance)
    assert says.startswith("joint " if blind else "something holds or pushes joint ")
    bench.drive(1.0, operator, l2=0.6)
    assert bench.state == "armed"
    assert bench.robot.status(bench.now_s).hindrance is None
    following = bench.robot.summary()["following"]
    assert (following["noticed"] == {}, following["held"] > 0) == (not blind, not blind)


def test_starts_turns_stops_and_a_reset_are_no_fault() -> None:
    bench, operator = armed(nothing)
    for fields in ({"r2": 1.0}, {}, {"l2": 1.0}, {"r2": 0.3}, {"lateral": (1.0, -0.5)}, {"run": False}):
        bench.drive(0.4, operator, **fields)
    bench.drive(0.3, operator, emergency_stop=True)
    bench.arm.arm.put_back()  # type: ignore[attr-defined]
    bench.robot.motion.following.restart()
    bench.drive(0.3, operator)
    bench.silence(0.3)
    assert bench.ticks * TICK_S > 3.0
    summary = bench.robot.summary()
    assert (summary["following"], summary["ticks"]) == ({"noticed": {}, "held": 0}, bench.ticks)
