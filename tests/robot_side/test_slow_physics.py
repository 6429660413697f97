"""300 free bodies on a machine that is far too slow for them: no turn is long, and an emergency stop is not late.

The machine's time is virtual: a step of the physics lasts 8 ms on it, whatever this one needs.
"""

from pathlib import Path

import numpy as np
import pytest

from common.arrays import FloatArray
from common.protocol.codec import decode
from common.protocol.messages import StiffnessUpdate
from operator_side.core import OperatorSide
from operator_side.dualsense.reports.controller_state import Button, ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from robot_side.arm.port import Arm, ArmState
from robot_side.assembly import Assembled, assemble
from robot_side.settings import RobotSettings
from robot_side.simulation.arm import LONGEST_TURN_S
from tests.helpers.repository import ROOT

BODIES = 300
STEP_S = 8e-3
REST_S = 4e-3
"""All else of a turn lasts so long there."""
TURN_S = LONGEST_TURN_S + 2.0 * STEP_S
PEER = b"operator"
FREE = '<body name="b{i}" pos="{x} {y} {z}"><freejoint/><geom type="box" size=".02 .02 .02" mass=".1"/></body>'


class SlowMachine:
    """Each look at its clock takes as long as a step does on it."""

    def __init__(self) -> None:
        self.now_s = 50.0

    def now(self) -> float:
        self.now_s += STEP_S
        return self.now_s


class ToldArm:
    """As the arm that it stands in front of; it remembers what it was told last."""

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self.joint_count = arm.joint_count
        self.command_gripper, self.told = arm.command_gripper, np.zeros(arm.joint_count)

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        self.told = joint_velocity_rad_s.copy()
        self._arm.command(joint_velocity_rad_s, valid_until_s)

    def state(self, now_s: float) -> ArmState:
        return self._arm.state(now_s)


class Pair:
    """A robot side on that machine, and an operator side with a controller in the test's hands."""

    def __init__(self, model: Path) -> None:
        self.machine = SlowMachine()
        self.arms: list[ToldArm] = []
        self.robot: Assembled = assemble(RobotSettings(model=model, site="tool"), 1, "clock", watch=self._watch)
        self.robot.arm.give_way(self.machine)
        self.operator = OperatorSide(2, "clock")
        self.longest_s = 0.0

    def _watch(self, arm: Arm) -> Arm:
        self.arms.append(ToldArm(arm))
        return self.arms[-1]

    def turn(self, *buttons: Button, r2: float = 0.0) -> StiffnessUpdate:
        """Commands arrive, a tick follows, and what it sends arrives at once; the newest field."""
        self.machine.now_s += REST_S
        began_s = self.machine.now_s
        self.operator.read_report(build_input_report(ControllerState(r2=r2, pressed=frozenset(buttons))), began_s)
        for payload in self.operator.motion(began_s):
            self.robot.core.receive(PEER, payload, began_s)
        sent = self.robot.core.tick(began_s)
        self.longest_s = max(self.longest_s, self.machine.now_s - began_s)
        haptics = [message.payload for message in sent if message.stream == "haptics"]
        for payload in haptics:
            self.operator.receive(payload, self.machine.now_s)
        return [one for payload in haptics if isinstance(one := decode(payload), StiffnessUpdate)][-1]

    def drive(self) -> None:
        """Arm, and advance for a while."""
        for _ in range(60):
            self.turn()
        states = [self.turn(Button.OPTIONS, Button.L1).state for _ in range(3)]
        assert states[-1] == "armed"
        for _ in range(10):
            assert self.turn(Button.L1, r2=0.5).state == "armed"
        assert np.abs(self.arms[0].told).max() > 0.01


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    source = (ROOT / "robot_side" / "simulation" / "assets" / "arm.xml").read_text(encoding="utf-8")
    bodies = "".join(
        FREE.format(i=i, x=0.6 + 0.05 * (i % 15), y=0.05 * (i // 15 % 15) - 0.4, z=0.05 + 0.05 * (i // 225))
        for i in range(BODIES)
    )
    table = '<geom name="table" type="box" pos="0.9 0 -0.02" size="0.6 0.6 0.02"/>'
    model = tmp_path_factory.mktemp("model") / "bodies.xml"
    model.write_text(source.replace("</worldbody>", f"{table}{bodies}</worldbody>", 1), encoding="utf-8")
    return Pair(model)


def test_no_turn_is_long_and_a_stop_is_obeyed_and_acknowledged_by_the_turn_that_hears_it(pair: Pair) -> None:
    pair.drive()
    assert pair.turn(Button.CIRCLE, Button.L1, r2=0.5).state == "stopped"
    assert np.array_equal(pair.arms[0].told, np.zeros(pair.arms[0].joint_count))
    for _ in range(20):
        assert pair.turn(Button.L1, r2=0.5).state == "stopped"
        assert not pair.arms[0].told.any()
    state = pair.arms[0].state(pair.machine.now_s)
    assert np.abs(state.joint_velocities_rad_s).max() < 1e-3
    assert 0.02 < pair.longest_s <= TURN_S < 0.04
    assert pair.robot.arm.share_of_real_time < 0.5
