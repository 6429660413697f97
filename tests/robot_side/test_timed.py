"""The arm and the law that stand in front of the real ones do what those do, and count their time."""

import numpy as np
import pytest

from common.clock import VirtualClock
from common.realtime.stages import Stages
from robot_side.assembly import assemble
from robot_side.settings import RobotSettings
from robot_side.timed import HELPS, STAGES, TimedArm, TimedLaw


def test_a_timed_core_sends_what_a_plain_one_does_and_counts_physics_and_sensing() -> None:
    stages = Stages(STAGES, VirtualClock(), Ticking())
    settings = RobotSettings()
    plain = assemble(settings, 1, "clock")
    timed = assemble(
        settings,
        1,
        "clock",
        watch=lambda arm: TimedArm(arm, stages),
        other_law=lambda law: TimedLaw(law, stages),
    )
    for turn in range(30):
        now_s = 1.0 + 1e-3 * turn
        assert timed.core.tick(now_s) == plain.core.tick(now_s)
        stages.end_turn()
    assert timed.core.summary() == plain.core.summary()
    assert np.array_equal(timed.scene.data.qpos, plain.scene.data.qpos)
    summary = stages.summary()
    for name in ("physics", "sensing"):
        assert summary[name]["cpu_us"]["p50"] == pytest.approx(1.0)
    assert summary["messages"]["cpu_us"]["max"] == 0.0


def test_each_stage_has_its_help() -> None:
    assert set(HELPS) == {*STAGES, ""}


class Ticking:
    """A processor's clock that has gone on by a microsecond whenever it is read."""

    def __init__(self) -> None:
        self._reads = 0

    def now(self) -> float:
        self._reads += 1
        return 1e-6 * self._reads
