"""The driver for LeRobot's arms, with fakes of LeRobot, socket and clock; tests/lerobot has the real LeRobot."""

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import msgpack
import msgspec
import pytest

from robot_side.drivers.remote.messages import DriverState, decoded
from tests.helpers.lerobot_fakes import FakeFollower, FakeSocket, FakeTime, lerobot_arm

PERIOD_S = 0.02
STILL = [0.0] * 5


@pytest.fixture
def socket() -> FakeSocket:
    return FakeSocket()


@pytest.fixture
def module(socket: FakeSocket) -> ModuleType:
    return lerobot_arm(socket)


@pytest.fixture
def driver(module: ModuleType) -> Any:
    return module.Driver("inproc://nobody")


def turns(driver: Any, follower: FakeFollower, since_s: float, count: int) -> None:
    """Run turns at 50 Hz."""
    for turn in range(count):
        follower.send_action(driver.turn(follower.get_observation(), since_s + PERIOD_S * turn))


def test_goals_integrate_velocities_and_stand_when_these_expire(driver: Any, socket: FakeSocket) -> None:
    follower = FakeFollower()
    turns(driver, follower, 10.0, 2)
    assert socket.sent[-1]["joint_positions"][:2] == pytest.approx([math.radians(10.0), math.radians(-20.0)])
    assert socket.sent[-1]["echo_s"] is None
    socket.command([0.1, 0.2, 0.0, 0.0, 0.0], 10.53)
    turns(driver, follower, 10.04, 50)
    moved_s = 10.53 - 10.02
    assert follower.at["shoulder_pan.pos"] == pytest.approx(10.0 + math.degrees(0.1 * moved_s))
    assert follower.at["shoulder_lift.pos"] == pytest.approx(-20.0 + math.degrees(0.2 * moved_s))
    assert socket.sent[-1]["joint_velocities"] == pytest.approx(STILL, abs=1e-3)
    assert socket.sent[-1]["echo_s"] == 5.0
    fastest = max(state["joint_velocities"][1] for state in socket.sent)
    assert fastest == pytest.approx(0.2, rel=0.01)


def test_a_state_is_one_that_the_robot_side_takes(driver: Any, socket: FakeSocket) -> None:
    turns(driver, FakeFollower(), 10.0, 1)
    state = decoded(msgpack.packb(socket.sent[0]), msgspec.msgpack.Decoder(DriverState), 1)
    assert (len(state.joint_positions), len(state.finger_positions or ())) == (5, 1)
    assert state.opening_m == pytest.approx(0.112)
    assert socket.sent[0]["condition"] == "ready"
    assert socket.sent[0]["limits"].keys() == {"velocity_rad_s", "acceleration_rad_s2", "latency_s"}


def test_a_goal_waits_for_a_joint_that_something_holds(driver: Any, socket: FakeSocket) -> None:
    follower = FakeFollower()
    follower.moves = False
    socket.command([0.5, 0.0, 0.0, 0.0, 0.0], 100.0)
    turns(driver, follower, 0.0, 200)
    lead_rad = driver._goals[0] - math.radians(10.0)
    assert 0.085 < lead_rad < 0.1
    # Back it goes at once.
    socket.command([-0.5, 0.0, 0.0, 0.0, 0.0], 100.0)
    turns(driver, follower, 4.0, 1)
    assert driver._goals[0] - math.radians(10.0) == pytest.approx(lead_rad - 0.01)


def test_a_false_reading_moves_no_goal_faster_than_told(driver: Any, socket: FakeSocket) -> None:
    follower = FakeFollower()
    turns(driver, follower, 0.0, 2)
    socket.command([0.1, 0.0, 0.0, 0.0, 0.0], 100.0)
    before = list(driver._goals)
    follower.at = dict.fromkeys(follower.at, -180.0)
    driver.turn(follower.get_observation(), 0.04)
    assert driver._goals == pytest.approx(before, abs=0.1 * PERIOD_S + 1e-9)


def test_a_gap_moves_no_goal(driver: Any, socket: FakeSocket) -> None:
    follower = FakeFollower()
    turns(driver, follower, 0.0, 2)
    socket.command([0.5, 0.0, 0.0, 0.0, 0.0], 6.0)
    turns(driver, follower, 5.0, 1)
    assert follower.at["shoulder_pan.pos"] == pytest.approx(10.0)
    turns(driver, follower, 5.02, 1)
    assert follower.at["shoulder_pan.pos"] == pytest.approx(10.0 + math.degrees(0.5 * PERIOD_S))


def test_a_jaw_holds_what_it_cannot_close_on_until_it_opens(driver: Any, socket: FakeSocket) -> None:
    follower = FakeFollower()
    follower.blocked_at = 40.0
    socket.command(STILL, 3.0, closing=1.0)
    turns(driver, follower, 0.0, 200)
    assert (socket.sent[-1]["opening_m"], socket.sent[-1]["holding"]) == (pytest.approx(0.4 * 0.112), True)
    socket.command(STILL, 100.0, closing=-1.0)
    turns(driver, follower, 4.0, 20)
    assert not socket.sent[-1]["holding"]
    # A jaw that closes on nothing holds nothing.
    follower.blocked_at = 2.0
    socket.command(STILL, 100.0, closing=1.0)
    turns(driver, follower, 5.0, 200)
    assert not any(state["holding"] for state in socket.sent[-200:])


def drive(module: ModuleType, follower: FakeFollower, happens: Callable[[float], None]) -> None:
    """Run the driver's loop in virtual time; `happens` gets the seconds since its start after each turn."""
    clock = FakeTime(happens)
    module.__dict__["time"] = clock
    module.drive(follower, "inproc://nobody")


def test_a_bus_that_is_dead_for_a_while_is_a_fault_and_then_ready_again(module: ModuleType, socket: FakeSocket) -> None:
    follower = FakeFollower()

    def happens(at_s: float) -> None:
        follower.dead = 1.0 < at_s < 1.3
        if at_s > 2.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drive(module, follower, happens)
    conditions = [state["condition"] for state in socket.sent]
    first, last = conditions.index("fault"), len(conditions) - conditions[::-1].index("fault")
    assert set(conditions[:first] + conditions[last:]) == {"ready"}
    assert socket.sent[first]["condition_text"] == "servo bus: Failed to sync read 'Present_Position' after 3 tries."
    assert socket.sent[first]["measured_s"] == socket.sent[first - 1]["measured_s"]
    assert socket.sent[first]["sent_s"] - socket.sent[first]["measured_s"] > 0.1


def test_a_bus_that_is_dead_for_good_ends_the_driver_with_one_line(module: ModuleType) -> None:
    follower = FakeFollower()

    def happens(at_s: float) -> None:
        follower.dead = at_s > 1.0
        assert at_s < 5.0, "it goes on"

    with pytest.raises(SystemExit, match=r"^servo bus: [^\n]* \(for 3.0 s; check its power and its plugs\)$"):
        drive(module, follower, happens)


def test_what_a_servo_reports_is_a_fault(module: ModuleType, socket: FakeSocket) -> None:
    follower = FakeFollower()

    def happens(at_s: float) -> None:
        follower.status["elbow_flex"] = 36
        if at_s > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drive(module, follower, happens)
    assert socket.sent[0]["condition"] == "ready"
    assert socket.sent[-1]["condition"] == "fault"
    assert socket.sent[-1]["condition_text"] == "elbow_flex: temperature, elbow_flex: overload"


def test_a_refusal_is_printed(driver: Any, socket: FakeSocket, capsys: pytest.CaptureFixture[str]) -> None:
    socket.waiting.append({"version": 1, "refused": "joints"})
    turns(driver, FakeFollower(), 0.0, 1)
    assert capsys.readouterr().out == "refused: joints\n"
