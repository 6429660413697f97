from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel, Rumble
from operator_side.core import OperatorSide
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.feel.write_bucket import MOST_WRITES_PER_S, WriteBucket
from tests.helpers.messages import feedback, uniform_update

Fields = dict[str, Any]
STRENGTH = st.sampled_from([0, 1, 3, 8])
FELT: st.SearchStrategy[Fields] = st.fixed_dictionaries(
    {
        "l2": STRENGTH,
        "r2": STRENGTH,
        "rumble": st.sampled_from([0.0, 0.125, 0.875]),
        "state": st.sampled_from(["armed", "armed", "armed", "disarmed"]),
    }
)
NOTHING: Fields = {"l2": 0, "r2": 0, "rumble": 0.0, "state": "armed"}
DANGER = NOTHING | {"l2": 8, "r2": 8, "rumble": 0.875}


class Run:
    """Operator side that receives stiffness every millisecond, and the writes to its controller."""

    def __init__(self) -> None:
        self.side, self.robot = OperatorSide(2, "clock"), LinkEnd("robot", 1, "clock")
        self.device = SimulatedDualSense()
        self.tick = 0
        self.written_s: list[float] = []
        self.side.receive(encode(self.robot.hello(0.0)), 0.0)

    def feel(self, fields: Fields) -> None:
        self.tick += 1
        now_s = self.tick / 1000
        self.side.receive(encode(uniform_update(self.robot.stamp(now_s), **fields)), now_s)
        if (report := self.side.feel_now(now_s)) is not None:
            self.device.write(report, now_s)
            self.written_s.append(now_s)

    def most_in_a_second(self) -> int:
        times = np.array(self.written_s)
        return int((np.searchsorted(times, times + 1.0) - np.arange(len(times))).max()) if len(times) else 0


def assert_released_as_told(run: Run, fields: Fields) -> None:
    armed = fields["state"] == "armed"
    if not armed:
        assert run.device.released
    if not armed or fields["rumble"] == 0.0:
        assert run.device.rumble == Rumble()


@given(st.lists(st.tuples(FELT, st.integers(1, 20)), min_size=1, max_size=8))
@settings(max_examples=40)
def test_whatever_comes_it_is_bounded_releases_at_once_and_lets_danger_through(
    repeated: list[tuple[Fields, int]],
) -> None:
    run = Run()
    while run.tick < 1500:
        for fields, ticks in repeated:
            for _ in range(ticks):
                run.feel(fields)
            assert_released_as_told(run, fields)
    for _ in range(200):
        run.feel(DANGER)
    assert run.device.strengths == ((8,) * 10, (8,) * 10)
    assert run.device.rumble.left > 0.8
    assert run.most_in_a_second() <= MOST_WRITES_PER_S


def test_a_change_after_a_rest_goes_at_once() -> None:
    run = Run()
    for strength in range(1, 9):
        run.tick -= 1  # All in one millisecond.
        run.feel(NOTHING | {"r2": strength})
    assert len(run.written_s) == 8


def test_what_is_left_waits_while_a_part_goes_off() -> None:
    stiff, stiffer = feedback(0, 3), feedback(0, 5)
    bound, written = WriteBucket(), RELEASED
    for number in range(100):
        wanted = Feel(l2=stiffer if number % 2 else stiff, r2=FREE_TRIGGER, rumble=Rumble())
        written = bound.next(written, wanted, 1.0) or written
    assert written.l2 != FREE_TRIGGER
    wanted = Feel(l2=FREE_TRIGGER, r2=stiff, rumble=Rumble())
    assert bound.next(written, wanted, 1.0) == RELEASED
    assert bound.next(RELEASED, wanted, 1.0) is None
    assert bound.next(RELEASED, wanted, 1.05) == wanted


def test_a_controller_that_nobody_knows_is_released_whatever_is_left() -> None:
    bound, stiff = WriteBucket(), Feel(l2=feedback(0, 3), r2=FREE_TRIGGER, rumble=Rumble())
    assert [bound.next(None, stiff, 1.0) for _ in range(100)] == [RELEASED] * 100
    assert bound.next(RELEASED, stiff, 1.0) is None
    assert bound.next(RELEASED, stiff, 1.05) == stiff
