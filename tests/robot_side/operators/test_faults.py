"""Faults in the stream of commands, and when exactly the arm reacts. Each test fails if its guard is removed.

test_operator_machine.py covers what needs no arm: who commands, which commands count, and stops.
"""

import math
from collections import deque
from collections.abc import Callable

import msgpack
import numpy as np
import pytest

from common.protocol.codec import encode
from common.protocol.link_end import Arrival
from robot_side.arm.limits import DECELERATION_RAD_S2
from robot_side.drivers.mujoco.joint_reference import JointReference
from robot_side.operators.safety import Permission, Safety
from tests.robot_side.session_bench import COMMAND_PERIOD_TICKS, CRUISE, QUICK, TICK_S, Bench, Operator

T_S = QUICK.safety.gap_s
RESTING_RAD_S = 0.005
Patch = Callable[[pytest.MonkeyPatch], None]


def cruising() -> tuple[Bench, Operator]:
    bench = Bench()
    operator = bench.join(2)
    bench.cruise(operator)
    return bench, operator


def begins_to_slow_s(bench: Bench, before: int) -> float:
    """Return the time at which the arm began to slow down after its first `before` states."""
    even = float(np.median([speed for _, speed in bench.watch.speeds_rad_s[before - 20 : before]]))
    later = bench.watch.speeds_rad_s[before:]
    measured_s, speed = next(one for one in later if one[1] < 0.95 * even)
    # By now the arm has slowed down for a while, at a known rate.
    return measured_s - (even - speed) / DECELERATION_RAD_S2


def stream_stops() -> None:
    """The commands stop, as they do after kill -9, with a half-open connection, or with a pulled cable."""
    bench, operator = cruising()
    accepted_s, before = bench.now_s - 3 * TICK_S, len(bench.watch.speeds_rad_s)
    bench.silence(T_S + 0.3)
    assert T_S - 5e-4 <= begins_to_slow_s(bench, before) - accepted_s <= T_S + 5e-3
    assert bench.speed_rad_s < RESTING_RAD_S
    told = bench.watch.told_to_move
    bench.drive(0.3, operator, r2=CRUISE)
    assert (bench.state, bench.watch.told_to_move) == ("disarmed", told)
    assert bench.speed_rad_s < RESTING_RAD_S
    bench.cruise(operator)
    assert bench.speed_rad_s > RESTING_RAD_S


def nobody_ticks() -> None:
    """The robot side stops ticking: the arm itself must then stop when its last command is no longer valid."""
    bench, _ = cruising()
    start_s, before = bench.now_s, len(bench.watch.speeds_rad_s)
    for millisecond in range(1, 1001):
        bench.watch.note(bench.arm.state(start_s + millisecond * TICK_S))
    assert T_S - 5e-4 <= begins_to_slow_s(bench, before) - (start_s - 3 * TICK_S) <= T_S + 5e-3
    assert bench.speed_rad_s < RESTING_RAD_S


def short_gaps() -> None:
    bench, operator = cruising()
    for gap_ms in (50, 90, 99):
        before = bench.speed_rad_s
        bench.silence(1e-3 * gap_ms - TICK_S)
        assert bench.speed_rad_s > 0.98 * before
        bench.drive(0.03, operator, r2=CRUISE)
    assert bench.state == "armed"


def steady_delay() -> None:
    """A constant delay of 1 s from the operator to the arm is no fault: the arm moves as fast as without it."""
    speeds = [mean_speed_rad_s(delay_s) for delay_s in (0.0, 1.0)]
    assert speeds[1] == pytest.approx(speeds[0], rel=0.02)


def mean_speed_rad_s(delay_s: float) -> float:
    bench = Bench()
    operator, sent = bench.operator(2), 0
    under_way: deque[tuple[float, bytes]] = deque()
    for step in range(4000):
        bench.tick()
        if step % COMMAND_PERIOD_TICKS == 0 and operator.token:
            sent += 1
            # Released for half a second, armed, then held.
            payload = operator.command(bench.now_s, r2=CRUISE if sent > 145 else 0.0, arm=135 < sent <= 140)
            under_way.append((bench.now_s + delay_s, payload))
        elif step % 200 == 0 and not operator.token:
            under_way.append((bench.now_s + delay_s, encode(operator.link.hello(bench.now_s))))
        while under_way and under_way[0][0] <= bench.now_s + 1e-9:
            bench.robot.receive(operator.peer, under_way.popleft()[1], bench.now_s)
    assert bench.state == "armed"
    return float(np.mean([speed for _, speed in bench.watch.speeds_rad_s if speed > RESTING_RAD_S][100:400]))


def no_gap(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Safety, "_check_gap", lambda *_: None)


def valid_for_ever(patch: pytest.MonkeyPatch) -> None:
    command = JointReference.command
    patch.setattr(JointReference, "command", lambda self, velocity, _: command(self, velocity, 1e9))


def valid_for_half(patch: pytest.MonkeyPatch) -> None:
    permission = Safety.permission

    def shorter(self: Safety, now_s: float) -> Permission:
        found = permission(self, now_s)
        return found._replace(valid_until_s=found.valid_until_s - self.settings.gap_s / 2)

    patch.setattr(Safety, "permission", shorter)


def old_by_delay(patch: pytest.MonkeyPatch) -> None:
    def late(_: Safety, arrival: Arrival) -> bool:
        return arrival.one_way_s is None or arrival.one_way_s > 0.18

    patch.setattr(Safety, "_queued_too_long", late)


FAULTS: dict[Callable[[], None], Patch] = {
    stream_stops: no_gap,
    nobody_ticks: valid_for_ever,
    short_gaps: valid_for_half,
    steady_delay: old_by_delay,
}
each = pytest.mark.parametrize(("fault", "disable"), FAULTS.items(), ids=[fault.__name__ for fault in FAULTS])


@each
def test_the_arm_bears_it_and_without_the_guard_it_does_not(
    fault: Callable[[], None], disable: Patch, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault()
    disable(monkeypatch)
    with pytest.raises((AssertionError, StopIteration)):
        fault()


def test_a_spoilt_command_of_the_owner_is_rejected_whole_and_counted() -> None:
    bench, operator = cruising()
    last = bench.robot.session.safety.command
    spoilt = [
        (2, math.nan),
        (3, math.inf),
        (3, 1.01),
        (4, [0.0, math.nan]),
        (5, [0.0]),
        (7, 1),
        (12, -1),
        (13, "nobody"),
    ]
    for place, value in spoilt:
        version, content = msgpack.unpackb(operator.command(bench.now_s, r2=1.0))
        content[place] = value
        bench.robot.receive(operator.peer, msgpack.packb([version, content]), bench.now_s)
        assert bench.robot.session.safety.command is last
    assert bench.robot.session.rejected == len(spoilt)


def test_the_delay_of_driving_is_that_of_each_command_of_the_armed_owner() -> None:
    bench, operator = cruising()
    observer, delays = bench.join(3, b"observer"), bench.robot.session.driving_delay
    before = delays.count
    payload = bench.send(operator)
    assert delays.count == before + 1
    bench.robot.receive(operator.peer, payload, bench.now_s)
    bench.send(observer)
    assert delays.count == before + 1
    bench.silence(T_S + 0.1)
    bench.send(operator)
    assert (bench.state, delays.count) == ("disarmed", before + 1)
