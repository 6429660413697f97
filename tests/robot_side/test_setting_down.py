"""A held object is set down by the simulated arm: downward motion ends at the contact, and release moves nothing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robot_side.arm.port import ArmState
from robot_side.arm.touchdown import carried_n
from robot_side.parts import build_parts
from tests.helpers.repository import DATA
from tests.robot_side.passed_on_arm import PassedOnArm
from tests.robot_side.session_bench import QUICK, Bench

SETTINGS = replace(QUICK, model=DATA / "place_held.xml", site="tool")


class Forgetful(PassedOnArm):
    def state(self, now_s: float) -> ArmState:
        return replace(self.arm.state(now_s), joint_loads_nm=None)


class Placing(Bench):
    """Robot side whose tool points down and holds a box 10 mm above a table."""

    def __init__(self, *, measures: bool = True) -> None:
        parts = build_parts(SETTINGS, 1, "clock")
        self.simulated = parts.arm
        super().__init__(parts=parts if measures else replace(parts, arm=Forgetful(parts.arm)))
        self.owner = self.join(2)
        self.arm_it(self.owner)
        self.go(1.0)
        assert self.robot.held == "target"
        self.go(1.55, r2=0.8)
        assert not self.stands

    def go(self, duration_s: float, gripper: float = 1.0, **fields: Any) -> None:
        self.drive(duration_s, self.owner, gripper=gripper, **fields)

    def set_down(self) -> None:
        self.go(0.8, r2=0.1)
        assert self.stands

    @property
    def stands(self) -> bool:
        return self.owner.updates[-1].stands

    @property
    def pressed_n(self) -> float:
        assert self.robot.newest is not None
        carried = carried_n(self.robot.newest[1].pose.tool_jacobian, self.simulated.state(self.now_s).joint_loads_nm)
        assert carried is not None
        return -carried


@pytest.mark.parametrize(("measures", "most_n"), [(True, 5.0), (False, 15.0)])
def test_what_stands_is_pressed_no_farther_and_nothing_springs_when_it_is_let_go(measures: bool, most_n: float) -> None:
    bench = Placing(measures=measures)
    bench.set_down()
    assert bench.robot.status(bench.now_s).stands is True
    where = bench.tool_m
    assert bench.pressed_n < most_n
    bench.go(0.5, r2=1.0)
    assert bench.pressed_n < most_n
    assert bench.owner.updates[-1].commanded_m_s == pytest.approx(0.0, abs=1e-3)
    bench.go(0.5, gripper=-1.0)
    assert np.abs(bench.tool_m - where).max() < 1e-3
    assert (bench.robot.held, bench.stands) == (None, False)


def test_what_stands_may_be_pushed_along_and_taken_away_and_set_down_again() -> None:
    bench = Placing()
    bench.set_down()
    where = bench.tool_m
    bench.go(0.3, r2=0.4, lateral=(0.5, 0.0))
    along = bench.tool_m - where
    assert np.linalg.norm(along[:2]) > 0.01
    assert abs(along[2]) < 1e-3
    assert bench.stands
    bench.go(0.3, l2=0.2)
    assert not bench.stands
    bench.set_down()
