"""All kernels that a side calls are compiled before its first tick."""

import sys
from typing import get_args

import pytest

from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.warm_up import import_kernels, warm_up
from robot_side.core import RobotSide
from robot_side.laws.named import LawName
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings


@pytest.mark.parametrize("law", get_args(LawName))
def test_nothing_is_compiled_within_a_tick(law: LawName, monkeypatch: pytest.MonkeyPatch) -> None:
    warm_up()
    assert all(kernel.ready for kernel in imported_kernels())

    def late(kernel: Compiled) -> None:
        raise AssertionError(f"{kernel.name} was not ready")

    robot = RobotSide(build_parts(RobotSettings(law=law), 1, "clock"))
    monkeypatch.setattr(Compiled, "prepare", late)
    for tick in range(20):
        robot.tick(0.001 * tick)


def test_they_are_found_on_a_robot_machine_without_the_extra_for_video(monkeypatch: pytest.MonkeyPatch) -> None:
    everything = import_kernels()
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.delitem(sys.modules, "robot_side.viewing.h264", raising=False)
    assert import_kernels() == everything
