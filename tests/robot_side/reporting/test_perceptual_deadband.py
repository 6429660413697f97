"""Enough messages are sent: a receiver that extrapolates the last one is never wrong by more than can be felt."""

import math
from collections import deque
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.following import follow
from common.protocol.messages import Compensation, Header, MotionCommand, MotionState, Telemetry
from common.reaction import WRITE_S
from common.silence import KEEP_ALIVE_S
from robot_side.reporting.perceptual_deadband import StiffnessDeadband, TelemetryDeadband
from robot_side.tick.sensed import Sensed
from tests.helpers.messages import field, onsets

TICK_S = 1e-3
A_M_S2, FULL_M_S = 3.0, 0.25
FAR_M = 0.4


ABLE: dict[str, Any] = {"full_speed_m_s": FULL_M_S, "acceleration_m_s2": A_M_S2}


def changed(found: Sensed, **changes: Any) -> Sensed:
    same = {name: getattr(found, name) for name in ("l2", "r2", "speed_m_s", "horizon_m", "rumble")}
    return Sensed(**same | changes)


def sensed(left_m: float, speed_m_s: float = 0.0, **changes: Any) -> Sensed:
    """Return what the law finds for a wall `left_m` ahead, in the direction of R2, and nothing behind."""
    wall = field(onsets(*(min(left_m + 1e-3 * k, FAR_M) for k in range(8))), **ABLE)
    free = field(onsets(*[FAR_M] * 8), **ABLE)
    return changed(Sensed(l2=free, r2=wall, speed_m_s=speed_m_s, horizon_m=FAR_M), **changes)


class Run:
    """Simulated gripper before a wall, and what a receiver computes from the last message, tick by tick."""

    def __init__(self, left_m: float, response_ticks: int = 0, **options: Any) -> None:
        """response_ticks: after which arm and receiver follow a command."""
        self.deadband = StiffnessDeadband(**options)
        self.deadband.response_s = response_ticks * TICK_S
        self.late = deque([0.0] * response_ticks)
        self.left_m, self.speed_m_s, self.commanded_m_s = left_m, 0.0, 0.0
        self.now_s, self.sent_s = 0.0, [-math.inf]
        self.believed_m, self.moved_m, self.believed_m_s = left_m, 0.0, 0.0

    def tick(self, commanded_m_s: float = 0.0, wall_m_s: float = 0.0, **how: Any) -> bool:
        self.now_s += TICK_S
        moved_m, self.speed_m_s = follow(0.0, self.speed_m_s, self.commanded_m_s, A_M_S2, TICK_S)
        self.moved_m, self.believed_m_s = follow(self.moved_m, self.believed_m_s, self.commanded_m_s, A_M_S2, TICK_S)
        self.left_m -= moved_m + wall_m_s * TICK_S
        self.late.append(commanded_m_s)
        self.commanded_m_s = self.late.popleft()
        state: MotionState = how.get("state", "armed")
        compensation: Compensation = how.get("compensation", "operator")
        travel = commanded_m_s / FULL_M_S
        header = Header(1, 1 + round(1e3 * self.now_s), self.now_s)
        command = MotionCommand(header, max(0.0, -travel), max(0.0, travel), run=True, compensation=compensation)
        now = how.get("now") or sensed(self.left_m, self.speed_m_s)
        content = (
            now,
            how.get("made_of_it_m_s", commanded_m_s),
            state,
            how.get("stands", False),
            how.get("hindered", False),
        )
        due = self.deadband.due(*content, command, self.now_s)
        if due:
            self.sent_s.append(self.now_s)
            self.believed_m, self.moved_m, self.believed_m_s = self.left_m, 0.0, self.speed_m_s
        return due

    @property
    def nearer_m(self) -> float:
        """Metres by which the wall is nearer than the receiver computes."""
        return self.believed_m - self.moved_m - self.left_m

    @property
    def since_s(self) -> float:
        return self.sent_s[-1] - self.sent_s[-2]


moves = st.lists(st.tuples(st.integers(1, 60), st.floats(-0.25, 0.25), st.floats(-0.4, 0.4)), min_size=1, max_size=8)


@given(st.floats(0.02, 0.35), moves, st.sampled_from([0, 0, 15, 50]))
@settings(derandomize=True, deadline=None, max_examples=100)
def test_the_receiver_is_never_wrong_by_more_than_can_be_felt(left_m: float, moves: Any, response_ticks: int) -> None:
    run = Run(left_m, response_ticks)
    for ticks, commanded_m_s, wall_m_s in moves:
        for _ in range(ticks):
            due = run.tick(commanded_m_s, wall_m_s)
            deadband_m = max(1e-3, 0.02 * run.left_m)
            if run.left_m < FAR_M - 0.01:
                assert run.nearer_m <= 0.25 * deadband_m + 1e-9
                if run.now_s - run.sent_s[-1] > WRITE_S:
                    assert run.nearer_m >= -deadband_m - 1e-9
            assert run.now_s - run.sent_s[-1] < KEEP_ALIVE_S + 1e-9
            if due and run.since_s < WRITE_S - TICK_S and len(run.sent_s) > 2:
                assert wall_m_s > 0.0 or commanded_m_s != 0.0  # Only for a wall nearer than believed.


@pytest.mark.parametrize(("turn_ms", "leaves_ms"), [(1, 20), (2, 20), (4, 20), (5, 20), (8, 16), (10, 20), (20, 20)])
def test_whatever_the_period_of_turns_the_keep_alive_is_hardly_late(turn_ms: int, leaves_ms: int) -> None:
    deadband, sent_ms = StiffnessDeadband(), list[int]()
    for now_ms in range(0, 500, turn_ms):
        late_s = 0.1e-3 * turn_ms * (now_ms // turn_ms % 2)
        if deadband.due(sensed(0.3), 0.0, "armed", False, False, None, 7.0 + 1e-3 * now_ms + late_s):
            sent_ms.append(now_ms)
    assert {later - earlier for earlier, later in pairwise(sent_ms)} == {leaves_ms}


def test_what_goes_as_reckoned_is_said_as_seldom_as_may_be() -> None:
    run = Run(0.3)
    assert run.tick(0.25)
    for _ in range(400):
        if run.tick(0.25):
            assert run.since_s == pytest.approx(KEEP_ALIVE_S)


def test_a_command_that_does_less_than_it_asks_for_is_found_out() -> None:
    run = Run(0.03)
    run.tick()
    while not run.tick(0.25, made_of_it_m_s=0.0, now=sensed(0.03, 0.25)):
        pass
    # A joint at its end: the receiver predicts by its own commands, and nothing moves.
    while not run.tick(0.25, made_of_it_m_s=0.0, now=sensed(0.03, 0.25)):
        pass
    assert run.since_s == pytest.approx(WRITE_S)


@pytest.mark.parametrize("wall_m_s", [0.5, -0.5])
def test_what_comes_nearer_is_said_at_once_and_what_goes_when_a_controller_can_be_told(wall_m_s: float) -> None:
    run = Run(0.03)
    run.tick()
    while not run.tick(wall_m_s=wall_m_s):
        pass
    # Half a millimetre a tick: the first is more than a quarter of 1 mm.
    assert run.since_s == pytest.approx(TICK_S if wall_m_s > 0.0 else WRITE_S)


def test_a_speed_that_the_receiver_does_not_expect_is_a_way_to_brake() -> None:
    run = Run(0.03)
    run.tick()
    # v^2 / 2 a: 0.24 mm, and 0.27 mm.
    assert not run.tick(now=sensed(0.03, 0.038))
    assert run.tick(now=sensed(0.03, 0.040))


def test_a_link_that_carries_no_more_is_told_less_often_but_of_a_state_at_once() -> None:
    run = Run(0.1)
    run.deadband.interval_s = 0.015
    run.tick()
    while not run.tick(wall_m_s=0.5):
        pass
    assert run.since_s == pytest.approx(0.015)
    assert run.tick(state="stopped")


def test_a_state_and_a_rumble_that_rises_are_said_at_once_and_one_that_falls_later() -> None:
    run = Run(0.3)
    run.tick()
    assert run.tick(state="stopped")
    assert run.tick()
    rumbling = sensed(0.3, rumble=0.5)
    assert run.tick(now=rumbling)
    for _ in range(8):
        assert not run.tick(now=rumbling)
    assert run.tick(now=sensed(0.3, rumble=0.625))
    while not run.tick(now=rumbling):
        pass
    assert run.since_s == pytest.approx(WRITE_S)


def test_that_something_stands_is_said_at_once_and_so_is_its_end() -> None:
    run = Run(0.3)
    run.tick()
    assert run.tick(stands=True)
    assert not run.tick(stands=True)
    assert run.tick(stands=True, hindered=True)
    assert run.tick(stands=True)
    assert run.tick()
    run.tick(stands=True)
    assert run.tick(stands=True, now=sensed(0.3, rumble=0.5))


def test_while_nothing_is_felt_only_the_state_and_the_keep_alive_count() -> None:
    run = Run(0.3)
    run.tick(state="disarmed")
    while not run.tick(wall_m_s=1.0, state="disarmed"):
        pass
    assert run.since_s == pytest.approx(KEEP_ALIVE_S)


def test_a_receiver_that_does_not_reckon_is_told_of_the_robot_sides_displacement() -> None:
    before, after = (
        changed(one, r2=field(one.r2.fast_m, displacement_m=displacement_m, **ABLE))
        for one, displacement_m in ((sensed(0.1), 0.0), (sensed(0.1), 0.01))
    )
    for compensation, due in (("robot", True), ("operator", False)):
        run = Run(0.1)
        run.tick(now=before, compensation=compensation)
        assert run.tick(now=after, compensation=compensation) == due


def test_a_horizon_that_shrinks_is_nothing_that_comes_nearer() -> None:
    run = Run(1.0)
    run.tick()
    shrunken = field(onsets(*[0.3] * 8), **ABLE)
    assert not run.tick(now=changed(sensed(1.0), l2=shrunken, r2=shrunken, horizon_m=0.3))


def test_another_receiver_is_told_at_once_and_at_full_rate_everything_is_said() -> None:
    run = Run(0.3)
    run.tick()
    assert not run.tick()
    run.deadband.forget()
    assert run.tick()
    full = Run(0.3, full_rate=True)
    assert all(full.tick() for _ in range(50))


def view(x_m: float = 0.0, l2: float = 0.0) -> Telemetry:
    return Telemetry(
        Header(0, 0, 0.0), "armed", (x_m, 0.0, 0.0), "cup", None, (0.0, 0.0, 1.0), 0.0, 0.08, False, 0.01, l2, 0.0
    )


@pytest.mark.parametrize(
    ("changed", "period_s"),
    [(view(), 0.1), (view(0.4e-3), 0.1), (view(0.6e-3), 0.02), (view(l2=0.009), 0.1), (view(l2=0.011), 0.02)],
)
def test_telemetry_leaves_when_the_change_can_be_seen(changed: Telemetry, period_s: float) -> None:
    looked = TelemetryDeadband()
    sent_s: list[float] = []
    for tick in range(1000):
        now_s, shown = tick * TICK_S, changed if len(sent_s) % 2 else view()
        if looked.may_be_due(("armed",), now_s) and looked.due(shown, now_s):
            sent_s.append(now_s)
    assert [later - earlier for earlier, later in pairwise(sent_s)] == pytest.approx([period_s] * (len(sent_s) - 1))


def test_other_words_are_shown_at_once() -> None:
    looked = TelemetryDeadband()
    assert looked.may_be_due(("disarmed",), 0.0)
    assert looked.due(view(), 0.0)
    assert not looked.may_be_due(("disarmed",), TICK_S)
    assert looked.may_be_due(("armed",), TICK_S)
    assert looked.due(view(), TICK_S)
