"""Rendering by our own commands under way, and by the robot side's displacement where they are unknown."""

from typing import Any

import msgspec
import pytest

from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Compensation, StiffnessUpdate
from common.protocol.session import SessionState
from operator_side.controller.state import Button
from tests.helpers.felt import felt, field, onsets
from tests.operator_side.operator_bench import Bench

PERIOD_S = 0.004
FREE = (0,) * 10
LEFT_M = 0.1
"""Distance to the wall. Without commands under way it is not felt, as full speed needs 85 mm"""


class Driving(Bench):
    """Bench on which R2 is pulled all the way at once, with no commands before."""

    def __init__(self, compensation: Compensation = "operator") -> None:
        super().__init__(compensation=compensation)
        self.compensation = compensation
        self.send(0.0)
        self.echo_s = self.now_s

    def send(self, r2: float, *buttons: Button) -> None:
        self.notice(SessionState.ARMED)
        self.hands(*buttons, r2=r2)
        assert {command.compensation for command in self.commands()} <= {self.compensation}

    def drive(self, duration_s: float, *buttons: Button) -> None:
        for _ in range(round(duration_s / PERIOD_S)):
            self.now_s += PERIOD_S
            self.send(1.0, *(buttons or (Button.L1,)))

    def report(self, **changes: Any) -> StiffnessUpdate:
        """Return a stiffness message with a wall ahead of R2, from a robot side without commands after `echo_s`."""
        wall = field(onsets(LEFT_M), displacement_m=changes.pop("displacement_m", 0.0))
        header = msgspec.structs.replace(
            self.robot.stamp(self.now_s), echo_sent_s=self.echo_s, echo_held_s=0.0, last_sent_s=None, last_held_s=None
        )
        return msgspec.structs.replace(felt(header), r2=wall, horizon_m=1.0, **changes)

    @property
    def r2(self) -> tuple[int, ...]:
        return self.device.strengths[1]

    @property
    def without_history(self) -> int:
        count: int = self.side.summary()["rendering"]["without_history"]
        return count


def test_commands_under_way_bring_it_nearer() -> None:
    bench = Driving()
    bench.feel_field(bench.report())
    assert bench.r2 == FREE
    bench.drive(0.2)
    bench.feel_field(bench.report())
    # δ = 0.25 * 0.2 - 0.25²/6 = 40 mm, w = 0.25 m/s. A zone of 0.184 m/s needs 40 + 55 + 5.6 + 0.7 = 101 mm.
    assert bench.r2 == (0,) * 5 + (8,) * 5
    assert bench.device.strengths[0] == FREE
    assert bench.without_history == 0


def test_ending_commands_means_stop() -> None:
    bench = Driving()
    bench.drive(0.1)
    for _ in range(2):  # Without a report of the controller nothing is sent.
        bench.now_s += 0.2
        bench.notice(SessionState.ARMED)
        assert bench.commands() == []
    bench.feel_field(bench.report())
    # The last command counts until the end of commands is noted, 0.2 s later: δ = 0.25 * 0.296 = 74 mm, w = 0.
    assert bench.r2 == (0,) * 3 + (8,) * 7
    assert bench.without_history == 0


@pytest.mark.parametrize(
    ("echo_s", "held_s"), [(None, None), (0.5, 0.0), (1e6, 0.0), (2.0, 100.0)], ids=["none", "old", "to come", "held"]
)
def test_without_history_the_robot_sides_counts_and_is_counted(echo_s: float | None, held_s: float | None) -> None:
    bench = Driving()
    bench.drive(0.2)
    report = bench.report(displacement_m=0.04, speed_m_s=0.25)
    header = msgspec.structs.replace(report.header, echo_sent_s=echo_s, echo_held_s=held_s)
    bench.feel_field(msgspec.structs.replace(report, header=header))
    assert bench.r2 == (0,) * 5 + (8,) * 5
    assert bench.without_history == 1


def test_an_observer_does_not_know_others_commands() -> None:
    bench = Driving()
    bench.drive(0.2)
    bench.notice(SessionState.OBSERVING)
    assert bench.commands() == []
    bench.feel_field(bench.report(displacement_m=0.04, speed_m_s=0.25))
    assert bench.without_history == 1
    assert bench.r2 == (0,) * 5 + (8,) * 5


def test_a_robot_side_that_restarted_has_heard_nothing_of_ours() -> None:
    bench = Driving()
    bench.drive(0.2)
    bench.robot = LinkEnd("robot", 9, "clock")
    bench.side.receive(encode(bench.robot.hello(bench.now_s)), bench.now_s)
    bench.feel(8)
    assert bench.without_history == 1
