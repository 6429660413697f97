"""The pipeline's kernels: all ready before the first tick."""

from typing import get_args

import pytest

from robot_side.ahead.law import LawName
from robot_side.assembly import assemble
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.warm_up import warm_up
from robot_side.settings import RobotSettings


def test_warm_up_prepares_the_kernels_of_the_whole_pipeline() -> None:
    warm_up()
    assert all(kernel.ready for kernel in imported_kernels())
    modules = {kernel.name.rpartition(".")[0] for kernel in imported_kernels()}
    assert {
        "robot_side.ahead.distances",
        "robot_side.ahead.felt",
        "robot_side.ahead.find",
        "robot_side.ahead.looks",
        "robot_side.ahead.kinds.next_frame",
        "robot_side.ahead.rounds",
        "robot_side.ahead.sideways",
        "robot_side.ahead.total_overlap",
        "robot_side.arm.ability",
        "robot_side.arm.commanded",
        "robot_side.arm.forward_kinematics",
        "robot_side.arm.joint_estimate",
        "robot_side.gripper.held_object",
        "robot_side.arm.resolved_rate",
        "robot_side.enlargement.kinematic_error",
        "robot_side.objects.validity",
        "robot_side.overlap.lanes.box_batch",
        "robot_side.overlap.lanes.tetrahedron_batch",
        "robot_side.overlap.precise.kernels",
    } <= modules


@pytest.mark.parametrize("law", get_args(LawName))
def test_nothing_is_compiled_within_a_tick(law: LawName, monkeypatch: pytest.MonkeyPatch) -> None:
    warm_up()

    def late(kernel: Compiled) -> None:
        raise AssertionError(f"{kernel.name} was not ready")

    robot = assemble(RobotSettings(law=law), 1, "clock").core
    monkeypatch.setattr(Compiled, "prepare", late)
    for tick in range(20):
        robot.tick(0.001 * tick)
