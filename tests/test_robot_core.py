"""The robot side as its peers see it, with the simulated arm in virtual time."""

import numpy as np
import pytest

from common.codec import decode, encode
from common.link_end import LinkEnd
from common.messages import Header, Hello, MotionCommand, StiffnessUpdate, Telemetry
from robot_side.assembly import build_robot_side
from robot_side.core import RobotSide
from robot_side.operator_session import OPERATOR_SILENT_S
from robot_side.settings import EnlargementOptions, RobotSettings

PEER = b"operator"


class Bench:
    """A robot side and an operator's end of the link, with every message delivered at once."""

    def __init__(self, settings: RobotSettings | None = None) -> None:
        self.robot: RobotSide = build_robot_side(settings or RobotSettings(), 1, "clock")
        self.now_s = 0.0
        self.inbox: dict[bytes, list[StiffnessUpdate | Hello]] = {}
        self.views: list[Telemetry] = []

    def join(self, peer: bytes, epoch: int) -> LinkEnd:
        operator = LinkEnd("operator", epoch, "clock")
        self.robot.receive(peer, encode(operator.hello(self.now_s)), self.now_s)
        return operator

    def tick(self) -> None:
        self.now_s += 0.001
        for outgoing in self.robot.tick(self.now_s):
            message = decode(outgoing.payload)
            if isinstance(message, Telemetry):
                self.views.append(message)
            else:
                assert isinstance(message, StiffnessUpdate | Hello)
                self.inbox.setdefault(outgoing.peer, []).append(message)

    def run(self, duration_s: float, operator: LinkEnd, peer: bytes = PEER, **fields: float | bool) -> None:
        """Ticks at 1 kHz with a command each 4 ms."""
        for step in range(round(duration_s * 1000)):
            self.tick()
            newest = [message for message in self.inbox.get(peer, []) if message.header.epoch == 1]
            if newest:
                operator.arrived(newest[-1], self.now_s)
            if step % 4 == 0:
                content: dict[str, float | bool] = {"l2": 0.0, "r2": 0.0, "run": True} | fields
                command = MotionCommand(operator.stamp(self.now_s), **content)  # type: ignore[arg-type]
                self.robot.receive(peer, encode(command), self.now_s)

    def arm(self, operator: LinkEnd, peer: bytes = PEER) -> None:
        self.run(1.1, operator, peer)
        self.run(0.02, operator, peer, arm=True)
        assert self.robot.session.safety.arming.state == "armed"

    @property
    def tool_m(self) -> np.ndarray:
        for _ in range(25):
            self.tick()
        return np.array(self.views[-1].tool_position_m)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_an_armed_robot_moves_as_asked_and_stops_when_commands_stop(bench: Bench) -> None:
    operator = bench.join(PEER, 2)
    bench.arm(operator)
    start = bench.tool_m
    bench.run(0.5, operator, r2=0.4)
    moved = bench.tool_m - start
    assert 0.03 < moved[0] < 0.07  # 0.1 m/s for half a second, and the gap that it holds
    assert np.abs(moved[1:]).max() < 0.01
    for _ in range(400):
        bench.tick()
    assert bench.robot.session.safety.arming.state == "disarmed"
    rest = bench.tool_m
    for _ in range(300):
        bench.tick()
    assert np.linalg.norm(bench.tool_m - rest) < 2e-3
    [stop] = bench.robot.summary()["stops"]
    assert "no command for" in stop["reason"]


def test_an_unarmed_robot_does_not_move(bench: Bench) -> None:
    operator = bench.join(PEER, 2)
    start = bench.tool_m
    bench.run(0.5, operator, r2=1.0)
    assert np.linalg.norm(bench.tool_m - start) < 2e-3


def test_a_second_operator_is_kept_out_until_the_first_is_silent(bench: Bench) -> None:
    first = bench.join(PEER, 2)
    bench.arm(first)
    second = bench.join(b"second", 3)
    intruding = MotionCommand(second.stamp(bench.now_s), l2=1.0, r2=0.0, run=True)
    bench.robot.receive(b"second", encode(intruding), bench.now_s)
    bench.run(0.1, first, r2=0.2)
    assert bench.robot.session.safety.arming.state == "armed"
    permission = bench.robot.session.safety.permission(bench.now_s)
    assert permission.command is not None
    assert permission.command.l2 == 0.0
    assert not any(isinstance(message, StiffnessUpdate) for message in bench.inbox.get(b"second", []))

    for _ in range(round(OPERATOR_SILENT_S * 1000) + 10):
        bench.tick()
    second = bench.join(b"second", 4)
    bench.arm(second, b"second")


def test_a_second_operator_cannot_stop_the_first(bench: Bench) -> None:
    first = bench.join(PEER, 2)
    bench.arm(first)
    second = LinkEnd("operator", 3, "clock")
    stop = MotionCommand(second.stamp(bench.now_s), l2=0.0, r2=0.0, emergency_stop=True)
    bench.robot.receive(b"second", encode(stop), bench.now_s)
    bench.run(0.02, first)
    assert bench.robot.session.safety.arming.state == "armed"


def test_the_operator_may_come_back_over_another_connection(bench: Bench) -> None:
    operator = bench.join(PEER, 2)
    bench.arm(operator)
    bench.run(0.05, operator, peer=b"reconnected")
    assert isinstance(bench.inbox[b"reconnected"][-1], StiffnessUpdate)
    assert bench.robot.session.safety.arming.state == "armed"


def test_a_restarted_operator_finds_the_arm_disarmed(bench: Bench) -> None:
    bench.arm(bench.join(PEER, 2))
    bench.now_s += OPERATOR_SILENT_S + 0.1
    restarted = bench.join(PEER, 3)
    bench.run(0.2, restarted, r2=1.0)
    assert bench.robot.session.safety.arming.state == "disarmed"


def test_an_operator_unknown_to_a_restarted_robot_is_told_so(bench: Bench) -> None:
    operator = LinkEnd("operator", 2, "clock")
    command = MotionCommand(operator.stamp(0.0), l2=0.0, r2=0.0)
    bench.robot.receive(PEER, encode(command), 0.0)
    bench.tick()
    [answer] = bench.inbox[PEER]
    assert isinstance(answer, Hello)
    assert bench.robot.session.rejected == 1


@pytest.mark.parametrize("payload", [b"", b"\x00", b"\xff" * 100, bytes(100_000)])
def test_garbage_is_counted_and_nothing_else(bench: Bench, payload: bytes) -> None:
    bench.robot.receive(PEER, payload, 0.0)
    assert bench.robot.session.rejected == 1
    bench.tick()
    assert bench.inbox == {}


def test_nothing_is_sent_to_an_operator_that_went_silent(bench: Bench) -> None:
    operator = bench.join(PEER, 2)
    bench.run(0.1, operator)
    for _ in range(round(OPERATOR_SILENT_S * 1000) + 10):
        bench.tick()
    sent = bench.robot.stiffness_sent
    for _ in range(100):
        bench.tick()
    assert bench.robot.stiffness_sent == sent


def test_the_target_is_switched_once_for_each_press(bench: Bench) -> None:
    operator = bench.join(PEER, 2)
    bench.run(0.1, operator)
    assert bench.views[-1].target == "target"
    bench.run(0.2, operator, next_target=True)
    second = bench.views[-1].target
    assert second not in {"target", None}
    bench.run(0.2, operator, next_target=True)
    assert bench.views[-1].target == second
    bench.run(0.1, operator)
    bench.run(0.2, operator, next_target=True)
    assert bench.views[-1].target not in {second, None}


def test_without_a_measured_delay_the_worst_case_holds(bench: Bench) -> None:
    bench.tick()
    assert bench.robot.status(bench.now_s)["loop_age_ms"] == pytest.approx(1000.0)


@pytest.mark.parametrize("direction", ["isotropic", "towards_object"])
@pytest.mark.parametrize("mode", ["once", "per_configuration"])
def test_every_way_of_enlarging_ticks(direction: str, mode: str) -> None:
    settings = RobotSettings(enlargement=EnlargementOptions(mode=mode, direction=direction))  # type: ignore[arg-type]
    bench = Bench(settings)
    for _ in range(3):
        bench.tick()
    assert bench.robot.summary()["enlargement_mm"]["min"] > 0.0


def test_an_echo_from_the_future_ages_nothing(bench: Bench) -> None:
    operator = bench.join(PEER, 2)
    bench.run(0.05, operator)
    invented = operator.stamp(bench.now_s)
    header = Header(invented.epoch, invented.sequence, invented.sent_s, echo_sent_s=bench.now_s + 60.0, echo_held_s=0.0)
    bench.robot.receive(PEER, encode(MotionCommand(header, l2=0.0, r2=0.0)), bench.now_s)
    for _ in range(10):
        bench.tick()
    assert bench.robot.session.loop_age_s(bench.now_s) is None
