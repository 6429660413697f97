"""Timing the stages of a tick does not change what the robot side does, and counts physics and sensing."""

import numpy as np
import pytest

from common.clock import VirtualClock
from common.realtime.stages import Stages
from robot_side.core import RobotSide
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.turn_stages import REMEDIES, STAGES, StageTiming


def test_a_timed_core_sends_what_a_plain_one_does_and_counts_physics_and_sensing() -> None:
    stages = Stages(STAGES, VirtualClock(), Ticking())
    plain, timed = (build_parts(RobotSettings(), 1, "clock") for _ in range(2))
    without, with_stages = RobotSide(plain), RobotSide(timed, [StageTiming(stages)])
    for turn in range(30):
        now_s = 1.0 + 1e-3 * turn
        assert with_stages.tick(now_s) == without.tick(now_s)
        stages.end_turn()
    assert with_stages.summary() == without.summary()
    assert np.array_equal(timed.scene.data.qpos, plain.scene.data.qpos)
    summary = stages.summary()
    for name in ("physics", "sensing"):
        assert summary[name]["cpu_us"]["p50"] == pytest.approx(1.0)
    assert summary["messages"]["cpu_us"]["max"] == 0.0


def test_each_stage_has_its_help() -> None:
    assert set(REMEDIES) == {*STAGES, ""}


class Ticking:
    """Stand-in for the processor clock that advances by a microsecond with each reading."""

    def __init__(self) -> None:
        self._reads = 0

    def now(self) -> float:
        self._reads += 1
        return 1e-6 * self._reads
