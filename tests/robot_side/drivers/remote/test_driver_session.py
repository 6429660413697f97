"""Arm behind a driver process, in virtual time: ages of its states, stops, and messages that are rejected whole."""

import math
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.arm.following import Following
from robot_side.arm.joint_estimate import lateness_s
from robot_side.arm.limits import ArmLimits
from robot_side.drivers.remote.driver_session import TAKEN_OVER_S
from robot_side.operators.safety import SafetySettings
from tests.robot_side.drivers.remote.driver_desk import AHEAD_S, LIMITS, SHAPE, TICK_S, DriverDesk


@pytest.mark.parametrize("delay_s", [0.0, 0.02])
@pytest.mark.parametrize("measuring_s", [0.0, 0.02])
def test_a_state_is_as_old_as_it_can_be_and_little_older(delay_s: float, measuring_s: float) -> None:
    desk = DriverDesk(delay_s, measuring_s, period_s=0.001)
    desk.run(1.0)
    true_s = delay_s + measuring_s
    # At worst the whole round trip counts as the delay from the driver.
    assert true_s - 1e-9 <= desk.age_s() <= true_s + delay_s + 0.006


def test_the_arm_follows_and_stops_by_its_own_clock_when_nothing_more_comes() -> None:
    desk = DriverDesk()
    desk.run(0.5)
    desk.run(0.5, velocity=0.4)
    assert desk.velocities == pytest.approx(0.4)
    desk.delay_s = math.inf
    for _ in range(110):
        desk.now_s += 0.001
        desk.drive()
    assert not desk.velocities.any()
    stopped = desk.joints
    assert stopped == pytest.approx(0.4 * 0.6, abs=0.4 * 0.03)


@pytest.mark.parametrize("delay_s", [0.0, 0.03])
def test_a_command_never_holds_longer_than_it_may_however_long_it_was_on_its_way(delay_s: float) -> None:
    desk = DriverDesk(delay_s)
    desk.run(1.0)
    desk.run(0.2, velocity=0.4)
    assert desk.newest is not None
    until_s = desk.newest["valid_until_s"] - AHEAD_S
    sent_s = desk.newest["sent_s"]
    assert sent_s + 0.1 - delay_s - 0.011 <= until_s <= sent_s + 0.1


def test_a_stop_leaves_at_once() -> None:
    desk = DriverDesk()
    desk.run(0.5)
    desk.run(0.2, velocity=0.4)
    desk.run(0.002)
    assert not desk.velocities.any()


def test_a_silent_driver_is_told_nothing_more_and_ages() -> None:
    desk = DriverDesk()
    desk.run(1.5)
    desk.speaks = False
    desk.run(0.3, velocity=0.4)
    assert desk.age_s() == pytest.approx(0.3, abs=0.02)
    assert any(note.startswith("arm lost: nothing heard from the driver for 0.1") for note in desk.notes)
    assert desk.arm.session.driver is None


def test_a_driver_that_was_stopped_goes_on_and_what_it_said_before_is_known_to_be_old() -> None:
    desk = DriverDesk()
    desk.run(0.5)
    before = desk.drivers_s
    desk.speaks = False
    desk.run(1.0)
    # The messages in its queue come first.
    desk.say(sent_s=before, measured_s=before, echo_s=None, held_s=0.0)
    desk.run(0.001)
    assert desk.age_s() > 0.9
    desk.speaks = True
    desk.run(0.05)
    assert desk.age_s() < 0.02


def test_one_stale_state_over_and_over_keeps_no_arm_alive_and_is_told_once_a_second() -> None:
    desk = DriverDesk()
    desk.run(1.5)
    said, desk.speaks = desk.drivers_s, False
    newest = desk.newest
    assert newest is not None
    held_s = said - AHEAD_S - newest["sent_s"]
    for _ in range(150):
        desk.say(sequence=1, sent_s=said, measured_s=said, echo_s=newest["sent_s"], held_s=held_s)
        desk.run(0.01, velocity=0.4)
        assert desk.age_s() >= desk.drivers_s - said - 1e-6
    assert desk.arm.session.rejected["order"] > 100
    assert len(desk.notes) <= 4


@pytest.mark.parametrize(("peer", "sequence"), [(b"another", 0), (b"another", 10**6), (b"driver", 0)])
def test_a_driver_that_restarts_begins_anew_with_another_clock(peer: bytes, sequence: int) -> None:
    desk = DriverDesk()
    desk.run(1.5)
    desk.speaks = False
    desk.run(1.5)
    desk.peer, desk.sequence, desk.newest, desk.speaks = peer, sequence, None, True
    desk.also = {"sent_s": 3.0, "measured_s": 3.0}
    desk.say()
    desk.also = {}
    desk.run(0.3)
    assert desk.age_s() < 0.02
    assert desk.notes.count("driver: connected") == 2
    assert not desk.arm.session.rejected


def test_a_driver_that_was_started_again_may_have_moved_the_arm_and_is_doubted_for_a_while() -> None:
    desk = DriverDesk()
    desk.run(1.5)
    desk.speaks = False
    desk.run(0.4)  # Shorter than --safety.arm-s may be.
    desk.sequence, desk.newest = 0, None
    desk.say(echo_s=None, held_s=0.0, joint_positions=[0.4, 0.0])
    desk.run(0.002)
    assert desk.arm.state(desk.now_s).doubt == "the driver was started again: look where the arm is"


def test_a_second_driver_is_refused_and_hears_why() -> None:
    desk = DriverDesk()
    desk.run(0.5)
    desk.say(b"second", joint_positions=[9.0, 9.0])
    desk.run(0.003)
    assert desk.arm.session.rejected == {"second": 1}
    assert "second" in desk.refused[0]
    assert desk.arm.state(desk.now_s).joint_positions_rad == pytest.approx(0.0)


@pytest.mark.parametrize(("pause_s", "taken"), [(0.15, False), (0.95, False), (1.05, True)])
def test_a_second_driver_takes_over_only_after_a_second_and_that_is_told(pause_s: float, taken: bool) -> None:
    desk = DriverDesk()
    desk.run(1.5)
    desk.speaks = False
    desk.run(pause_s)
    desk.say(b"second", echo_s=None, held_s=0.0, joint_positions=[1.0, 0.0])
    desk.run(0.002)
    assert desk.arm.session.rejected == ({} if taken else {"second": 1})
    doubt = desk.arm.state(desk.now_s).doubt
    assert doubt == ("another driver drives the arm now: look where it is" if taken else None)
    assert ("driver: another one has taken over" in desk.notes) is taken
    desk.speaks = True
    desk.run(0.3)
    # The first one goes on at once, or is now the second.
    assert (desk.arm.session.rejected["second"] > 5) is taken
    assert taken or desk.age_s() < 0.02


@given(
    st.lists(st.tuples(st.booleans(), st.booleans(), st.sampled_from([0.01, 0.09, 0.3, 0.95, 1.1])), max_size=5),
    st.sampled_from([0.05, 0.1, 0.99]),
)
@settings(max_examples=20)
def test_nobody_is_armed_when_another_driver_takes_over(talks: list[tuple[bool, bool, float]], arm_s: float) -> None:
    """The arm is lost in the turn that lets another driver in, or before, as long as `arm_s` may be."""
    safety = SafetySettings(arm_s=arm_s)
    desk, driver = DriverDesk(), b"driver"
    desk.run(0.3)
    for first, second, lasts_s in talks:
        desk.speaks = first
        for tick in range(round(lasts_s / TICK_S)):
            before, lost = driver, desk.age_s() > safety.arm_s
            if second and tick % 5 == 0:
                desk.say(b"second")
            desk.run(TICK_S)
            driver = desk.arm.session.driver or driver
            assert driver == before or lost


def test_a_state_may_not_be_so_old_that_another_driver_could_come_while_armed() -> None:
    with pytest.raises(ValueError, match=r"arm_s = 1\.0; valid: above 0 and below 1"):
        SafetySettings(arm_s=TAKEN_OVER_S)


@pytest.mark.parametrize(
    ("wrong", "why", "says"),
    [
        ({"joint_positions": [math.nan, 0.0]}, "malformed", "joint_positions"),
        ({"joint_velocities": [math.inf, 0.0]}, "malformed", "joint_velocities"),
        ({"joint_positions": [0.0]}, "joints", "joint_positions holds 1 values; valid: 2 (shoulder, elbow)"),
        ({"finger_positions": [0.0, 0.0]}, "joints", "valid: 1 (finger)"),
        ({"version": 2}, "version", "version 2; valid: 1"),
        ({"version": 2, "joint_positions": "elsewhere"}, "version", "version 2; valid: 1"),
        ({"sequence": 1}, "order", "sequence = 1; valid: above"),
        ({"measured_s": 1e9}, "malformed", "measured_s"),
        ({"sent_s": 2000.0, "measured_s": 2000.0}, "clock", "clock jumped"),
        ({"extra": 1}, "malformed", "extra"),
        ({"opening_m": 85.0}, "malformed", "opening_m"),
        ({"sent_s": 1.7e308, "measured_s": -1.7e308}, "malformed", "s"),
    ],
)
def test_what_cannot_be_is_rejected_whole_counted_and_told_once(wrong: dict[str, Any], why: str, says: str) -> None:
    desk = DriverDesk()
    desk.run(0.5)
    newest = desk.arm.session.state
    # A clock that has jumped is another clock: the next state by it counts.
    times = 1 if why == "clock" else 3
    for _ in range(times):
        desk.say(**wrong)
    desk.speaks = False
    desk.run(0.001)
    assert desk.arm.session.state is newest
    assert desk.arm.session.rejected == {why: times}
    assert len([note for note in desk.notes if says in note]) == 1
    desk.speaks = True
    desk.run(0.1)
    assert desk.age_s() < 0.03
    assert says in desk.refused[0]


def test_a_driver_that_echoes_nothing_is_told_so_and_never_trusted() -> None:
    desk = DriverDesk()
    desk.also = {"echo_s": None}
    desk.run(2.0)
    assert desk.arm.session.state is None
    assert any("echo_s" in note for note in desk.notes)
    assert desk.refused


def test_without_a_word_of_the_gripper_it_is_open() -> None:
    desk = DriverDesk()
    desk.run(0.5)
    state = desk.arm.state(desk.now_s)
    assert (state.finger_positions.tolist(), state.gripper_opening_m, state.joint_loads_nm) == ([0.04], 0.08, None)
    desk.also = {"finger_positions": [0.01], "opening_m": 0.02, "holding": True, "joint_loads": [1.0, 2.0]}
    desk.run(0.1)
    state = desk.arm.state(desk.now_s)
    assert (state.finger_positions.tolist(), state.gripper_opening_m) == ([0.01], 0.02)
    assert state.gripper_holding
    assert state.joint_loads_nm is not None
    assert state.joint_loads_nm.tolist() == [1.0, 2.0]


def test_a_command_that_is_none_is_refused_whole() -> None:
    desk = DriverDesk()
    for velocities in (np.zeros(3), np.array([np.nan, 0.0])):
        with pytest.raises(ValueError, match="2 finite"):
            desk.arm.command(velocities, 1.0)
    with pytest.raises(ValueError, match="-1 to 1"):
        desk.arm.command_gripper(1.5, 1.0)


class Careless(DriverDesk):
    """Driver that loses all commands but each `keeps`-th, and may move by each command for 4 ms only."""

    keeps, briefly = 1, False

    def send(self, peer: bytes, payload: bytes) -> bool:
        sequence = msgpack.unpackb(payload).get("sequence", 0)
        return self.keeps > 0 and sequence % self.keeps == 0 and super().send(peer, payload)

    def drive(self) -> None:
        if self.briefly and self.newest is not None and self.drivers_s - self._read_s >= 0.004:
            self.newest = self.newest | {"valid_until_s": 0.0}
        super().drive()


@pytest.mark.parametrize(
    ("keeps", "briefly", "says"),
    [
        (1, False, None),
        # Every second command is enough for who obeys each until it expires.
        (2, False, None),
        (0, False, "joint 1 (shoulder) and 1 more do not move"),
        (2, True, "joint 1 (shoulder) and 1 more move too slowly"),
    ],
)
@pytest.mark.parametrize(("delay_s", "period_s"), [(0.0, 0.005), (0.02, 0.033)])
def test_a_driver_that_loses_commands_is_noticed(
    keeps: int, briefly: bool, says: str | None, delay_s: float, period_s: float
) -> None:
    desk = Careless(delay_s, period_s=period_s)
    desk.run(0.5)
    desk.keeps, desk.briefly = (keeps or 10**9), briefly
    following = Following(LIMITS, SHAPE.joint_names)
    said = set()
    for tick in range(1300):
        velocity = 0.4 if tick > 100 else 0.0
        desk.run(TICK_S, velocity)
        state = desk.arm.state(desk.now_s)
        following.update(np.full(2, velocity), state, lateness_s(state, desk.now_s), lambda _: False)
        if tick <= 600:
            said.add(following.text)
    assert (says in said) if says else said == {None}
    assert (following.stop is not None) is (says is not None and "not move" in says)


def test_the_first_state_says_the_arms_limits_and_each_its_condition() -> None:
    desk = DriverDesk()
    desk.also = {"limits": {"velocity_rad_s": [1.0, 2.0], "acceleration_rad_s2": [3.0, 4.0], "latency_s": 0.05}}
    desk.run(0.1)
    desk.also = {"limits": {"velocity_rad_s": [9.0, 9.0]}}
    desk.run(0.1)
    assert desk.arm.session.said_limits == ArmLimits((1.0, 2.0), (3.0, 4.0), latency_s=0.05)
    # Whoever says others later is not believed: the law would go on with the first ones.
    assert "other limits than at the start" in (desk.arm.state(desk.now_s).doubt or "")
    desk.also = {}
    desk.run(0.7)
    assert desk.arm.state(desk.now_s).doubt is None
    assert desk.arm.state(desk.now_s).condition is None
    desk.also = {"condition": "protective_stop", "condition_text": "joint 4 met something"}
    desk.run(0.1)
    assert desk.arm.state(desk.now_s).condition == "the arm is in a protective stop: joint 4 met something"
    desk.also = {"condition": "emergency_stop"}
    desk.run(0.1)
    assert desk.arm.state(desk.now_s).condition == "the arm is in an emergency stop"


@pytest.mark.parametrize(
    ("fields", "why", "says"),
    [
        (
            {"limits": {"velocity_rad_s": [1.0]}},
            "joints",
            "limits.velocity_rad_s holds 1 values; valid: one number, or 2",
        ),
        ({"limits": {"velocity_rad_s": [1.0, -1.0]}}, "malformed", "limits.velocity_rad_s"),
        ({"limits": {"jerk_rad_s3": [5e-324, 1.0]}}, "malformed", "limits.jerk_rad_s3"),
        ({"limits": {"jerk_rad_s3": [0.01, 1.0]}}, "joints", "valid: up to 1 s"),
        ({"limits": {"speed": [1.0, 1.0]}}, "malformed", "speed"),
        ({"condition": "tired"}, "malformed", "condition"),
        ({"condition_text": "a\nb"}, "malformed", "printable"),
        ({"condition_text": "a" * 201}, "malformed", "condition_text"),
    ],
)
def test_wrong_limits_and_conditions_are_refused(fields: dict[str, Any], why: Any, says: str) -> None:
    desk = DriverDesk()
    desk.run(0.1)
    desk.also = fields
    desk.run(0.05)
    assert desk.arm.session.rejected[why] > 0
    assert says in desk.refused[0]
