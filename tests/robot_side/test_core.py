"""The robot side as its peers see it, with the simulated arm in virtual time."""

import numpy as np
import pytest

from common.protocol.messages import Header, Hello
from common.protocol.session import SessionState
from feelahead.experiments.faults.session_bench import Bench
from robot_side.settings import EnlargementOptions, RobotSettings


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_an_armed_robot_moves_as_asked_and_stops_when_commands_stop(bench: Bench) -> None:
    operator = bench.join(2)
    bench.arm_it(operator)
    start = bench.tool_m
    bench.drive(0.5, operator, r2=0.4)
    moved = bench.tool_m - start
    assert 0.03 < moved[0] < 0.07  # 0.1 m/s for half a second, and the gap that it holds
    assert np.abs(moved[1:]).max() < 0.01
    bench.tick(400)
    assert bench.state == "disarmed"
    rest = bench.tool_m
    bench.tick(300)
    assert np.linalg.norm(bench.tool_m - rest) < 2e-3
    [stop] = bench.robot.summary()["stops"]
    assert "no command for" in stop["reason"]


def test_an_unarmed_robot_does_not_move(bench: Bench) -> None:
    operator = bench.join(2)
    start = bench.tool_m
    bench.drive(0.5, operator, r2=1.0)
    assert np.linalg.norm(bench.tool_m - start) < 2e-3


def test_an_operator_unknown_to_a_restarted_robot_is_told_so(bench: Bench) -> None:
    operator = bench.operator(2)
    bench.send(operator)
    bench.tick()
    assert any(isinstance(message, Hello) for message in operator.inbox)
    assert operator.state is SessionState.UNKNOWN
    assert bench.robot.session.rejected == 1


@pytest.mark.parametrize("payload", [b"", b"\x00", b"\xff" * 100, bytes(100_000)])
def test_garbage_is_counted_and_nothing_else(bench: Bench, payload: bytes) -> None:
    bench.robot.receive(b"operator", payload, 0.0)
    assert bench.robot.session.rejected == 1
    operator = bench.operator(2)
    bench.tick()
    assert operator.inbox == []


def test_nothing_is_sent_to_an_operator_that_went_silent(bench: Bench) -> None:
    operator = bench.join(2)
    bench.drive(0.1, operator)
    bench.silence(1.0)
    sent = bench.robot.stiffness_sent
    bench.tick(100)
    assert bench.robot.stiffness_sent == sent


def test_the_target_is_switched_once_for_each_press(bench: Bench) -> None:
    operator = bench.join(2)
    bench.drive(0.1, operator)
    assert bench.views[-1].target == "target"
    bench.drive(0.2, operator, next_target=True)
    second = bench.views[-1].target
    assert second not in {"target", None}
    bench.drive(0.2, operator, next_target=True)
    assert bench.views[-1].target == second
    bench.drive(0.1, operator)
    bench.drive(0.2, operator, next_target=True)
    assert bench.views[-1].target not in {second, None}


def test_without_a_measured_delay_the_worst_case_holds(bench: Bench) -> None:
    bench.tick()
    assert bench.robot.status(bench.now_s)["loop_age_ms"] == pytest.approx(1000.0)


def test_the_status_says_who_pulls_how_far_everything_is_and_why_it_stopped(bench: Bench) -> None:
    status = bench.robot.status(bench.now_s)
    assert (status["link"], status["L2_pulled"], "nearest_mm" in status) == ("waiting for an operator", None, False)
    operator = bench.join(2)
    bench.arm_it(operator)
    bench.drive(0.2, operator, r2=0.4)
    status = bench.robot.status(bench.now_s)
    assert (status["link"], status["R2_pulled"], status["stopped_because"]) == ("up", 0.4, None)
    assert status["target"] == "target"
    before_mm = status["target_mm"]
    assert isinstance(before_mm, float)
    bench.drive(0.5, operator, r2=0.4)
    nearer_mm, nearest_mm = (bench.robot.status(bench.now_s)[name] for name in ("target_mm", "nearest_mm"))
    assert isinstance(nearer_mm, float)
    assert isinstance(nearest_mm, float)
    assert nearer_mm == pytest.approx(before_mm - 50.0, abs=15.0)
    assert nearest_mm <= nearer_mm
    bench.tick(400)
    status = bench.robot.status(bench.now_s)
    assert "no command for" in str(status["stopped_because"])
    assert status["R2_pulled"] is None
    bench.silence(1.0)
    assert bench.robot.status(bench.now_s)["link"] == "lost: nothing heard from the operator"
    assert bench.robot.summary()["loop_age_ms"]["mean"] > 0.0


@pytest.mark.parametrize("direction", ["isotropic", "towards_object"])
@pytest.mark.parametrize("mode", ["once", "per_configuration"])
def test_every_way_of_enlarging_ticks(direction: str, mode: str) -> None:
    settings = RobotSettings(enlargement=EnlargementOptions(mode=mode, direction=direction))  # type: ignore[arg-type]
    bench = Bench(settings)
    bench.tick(3)
    assert bench.robot.summary()["enlargement_mm"]["min"] > 0.0


def test_an_echo_from_the_future_ages_nothing(bench: Bench) -> None:
    operator = bench.join(2)
    bench.drive(0.05, operator)
    invented = operator.link.stamp(bench.now_s)
    header = Header(invented.epoch, invented.sequence, invented.sent_s, echo_sent_s=bench.now_s + 60.0, echo_held_s=0.0)
    bench.send(operator, header=header)
    bench.tick(10)
    assert bench.robot.session.loop_age_s(bench.now_s) is None
