"""Controller unplugged during a run, both sides in virtual time: the arm stops until it is armed again."""

from collections.abc import Callable

import pytest

from common.status.codes import ConnectionState
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from operator_side.controller.connection import LOOK_PERIOD_S, Connection
from operator_side.controller.state import Button
from operator_side.dualsense.hid.finding import Finder
from operator_side.hands.newest import INTENT_EXPIRES_S
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings
from tests.operator_side.dualsense.simulated_system import SimulatedSystem, VirtualSearch

pytestmark = pytest.mark.long

PLACE = b"usb"
GAP_S = 0.1
RAMP_S = 0.3
"""Seconds in which the arm comes to rest from any speed of this run"""


class Run:
    """Run of both sides with a scripted person, whose controller the test can unplug."""

    def __init__(self, link: str = "", *, wireless: bool = False) -> None:
        self.wireless = wireless
        self.both = Loopback(LoopbackSettings(RobotSettings(link=link), OperatorSettings(link=link)))
        self.system = SimulatedSystem()
        self.system.clock = self.both.clock
        self.system.devices[PLACE] = self.both.device
        self.both.connection = Connection(VirtualSearch(Finder(self.system), lambda: False), self.both.operator)

    def unplug(self) -> None:
        """Unplug the controller; of a wireless one, switch it off, so that its dongle repeats its last report."""
        if self.wireless:
            self.system.off = {PLACE}
        else:
            self.system.unplug(PLACE)

    def plug_in(self) -> None:
        self.system.off = set()
        self.system.devices[PLACE] = self.both.device

    def let_go_of_the_person(self) -> None:
        """Stop the scripted person, so that only the test operates the controller."""
        self.both.person.tick = lambda *_: None  # type: ignore[method-assign]

    def wait(self, duration_s: float) -> None:
        self.both.run_until(self.both.clock.now() + duration_s)

    def until(self, condition: Callable[[], bool], at_most_s: float) -> None:
        end_s = self.both.clock.now() + at_most_s
        while not condition():
            assert self.both.clock.now() < end_s, f"not within {at_most_s} s"
            self.wait(0.004)

    @property
    def state(self) -> str:
        return self.both.robot.session.safety.state

    @property
    def commands(self) -> int:
        return self.both.robot.session.motion_received

    @property
    def speed_m_s(self) -> float:
        assert self.both.operator.screen is not None
        return self.both.operator.screen.tool_speed_m_s


WIRELESS = pytest.mark.parametrize("wireless", [False, True])


def advancing(link: str = "", *, wireless: bool) -> Run:
    """Return a run in which the arm moves and a trigger is stiff."""
    run = Run(link, wireless=wireless)
    run.until(lambda: not run.both.device.released, 12.0)
    assert run.state == "armed"
    run.let_go_of_the_person()
    return run


@WIRELESS
@pytest.mark.parametrize("delay_ms", [0, 100])
def test_unplugged_the_arm_stops_and_stays(delay_ms: int, wireless: bool) -> None:
    run = advancing(f"delay {delay_ms}ms" if delay_ms else "", wireless=wireless)
    assert run.speed_m_s > 0.01
    run.unplug()
    # Messages under way still arrive; and what a dongle repeats counts as held for 0.1 s.
    run.wait(1e-3 * delay_ms + 0.01 + (INTENT_EXPIRES_S if wireless else 0.0))
    commands = run.commands
    run.wait(GAP_S)
    assert run.state == "disarmed"
    assert run.both.connection.state is ConnectionState.LOST
    assert run.both.device.released
    run.wait(1e-3 * delay_ms + RAMP_S)
    assert run.speed_m_s < 1e-3
    run.wait(3.0)
    assert run.commands == commands
    assert run.state == "disarmed"
    assert run.both.operator.lease is not None, "we still live, and keep the lease by our Hellos"


@WIRELESS
def test_plugged_in_again_it_resumes_disarmed_and_is_armed_on_purpose(wireless: bool) -> None:
    run = advancing(wireless=wireless)
    device = run.both.device
    run.unplug()
    run.wait(1.0)
    run.plug_in()
    commands = run.commands
    run.wait(LOOK_PERIOD_S + 2.0)
    # Trigger and hold-to-run are still held as before, which must not move the arm.
    assert run.both.connection.state is ConnectionState.CONNECTED
    assert run.commands > commands
    assert run.state == "disarmed"
    assert run.speed_m_s < 1e-3
    device.set_finger_force(0.0, 0.0)
    device.set_buttons(frozenset({Button.L1}))
    run.wait(1.3)
    assert run.state == "disarmed"
    device.set_buttons(frozenset({Button.L1, Button.OPTIONS}))
    run.until(lambda: run.state == "armed", 0.1)


def test_a_held_arming_button_arms_nothing_before_a_healthy_second() -> None:
    run = advancing(wireless=False)
    run.both.device.set_buttons(frozenset({Button.L1, Button.OPTIONS}))
    run.unplug()
    run.wait(0.5)
    run.plug_in()
    run.wait(4.0)
    assert run.both.connection.state is ConnectionState.CONNECTED
    assert run.state == "disarmed"
