"""Measured durations of a turn's stages, in virtual time."""

import pytest

from common.clock import VirtualClock
from common.realtime.stages import EVERY, Stages
from common.statistics import BLOCK


class Both:
    """Wall clock and processor clock, which a test advances."""

    def __init__(self) -> None:
        self.wall, self.processor = VirtualClock(), VirtualClock()

    def pass_(self, wall_s: float, processor_s: float) -> None:
        self.wall.advance_to(self.wall.now() + wall_s)
        self.processor.advance_to(self.processor.now() + processor_s)


def test_a_stage_adds_up_within_a_turn_and_restarts_in_the_next() -> None:
    clocks = Both()
    stages = Stages(("sockets", "law"), clocks.wall, clocks.processor, every=1)
    send, think = stages.timed("sockets", clocks.pass_), stages.timed("law", clocks.pass_)
    for _ in range(3):
        send(2e-6, 1e-6)
    clocks.pass_(1.0, 1.0)  # Belongs to no stage.
    think(10e-6, 8e-6)
    stages.end_turn()
    send(4e-6, 4e-6)
    stages.end_turn()
    summary = stages.summary()
    assert summary["sockets"]["wall_us"] == pytest.approx({"p50": 5.0, "p99": 5.98, "max": 6.0})
    assert summary["sockets"]["cpu_us"] == pytest.approx({"p50": 3.5, "p99": 3.99, "max": 4.0})
    assert summary["law"]["cpu_us"] == pytest.approx({"p50": 4.0, "p99": 7.92, "max": 8.0})
    assert stages.spent_s == pytest.approx([10e-6, 7e-6, 10e-6, 8e-6])


def test_turns_are_reckoned_with_in_blocks_and_none_is_lost() -> None:
    clocks = Both()
    stages = Stages(("law",), clocks.wall, clocks.processor, every=1)
    think = stages.timed("law", clocks.pass_)
    for _ in range(2 * BLOCK + 1):
        think(1e-6, 1e-6)
        stages.end_turn()
        assert len(stages._turns_s) < BLOCK
    stages.take_in()
    assert stages.spent_s[0] == pytest.approx((2 * BLOCK + 1) * 1e-6)


def test_sampled_turns_are_scaled_up_to_all_turns() -> None:
    clocks = Both()
    stages = Stages(("law",), clocks.wall, clocks.processor)
    think = stages.timed("law", clocks.pass_)
    for turn in range(4 * EVERY):
        think(1e-6 * turn, 2e-6)
        stages.end_turn()
    assert stages.summary()["law"]["wall_us"]["max"] == pytest.approx(3.0 * EVERY)
    assert stages.spent_s == pytest.approx([EVERY * EVERY * 6e-6, 4 * EVERY * 2e-6])
