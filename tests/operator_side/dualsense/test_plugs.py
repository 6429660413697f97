"""Controllers that are plugged in and pulled out amid faults: no trigger is left stiff."""

from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import LeaseNotice, MotionCommand
from common.protocol.session import SessionState
from common.status.codes import ConnectionState
from operator_side.controller.background_writes import STALL_S
from operator_side.controller.connection import BEAT_PERIOD_S, LOOK_PERIOD_S, Connection
from operator_side.controller.feel import RELEASED
from operator_side.controller.state import Button
from operator_side.core import OperatorSide
from operator_side.dualsense.hid.finding import Finder
from operator_side.dualsense.hid.release_watchdog import SILENCE_S
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.newest import INTENT_EXPIRES_S
from tests.helpers.messages import uniform_update
from tests.operator_side.dualsense.simulated_system import (
    PERIOD_S,
    SimulatedSystem,
    StallingWrites,
    VirtualSearch,
    VirtualWatchdog,
)


class Plugs(RuleBasedStateMachine):
    """Core of an operator side with two controllers on USB and Bluetooth, with faults of transfers and of our process.

    A stand-in for the robot side grants the lease and sends stiffness. It arms on request once the triggers were
    released, and disarms if no command comes for 100 ms.
    """

    def __init__(self) -> None:
        super().__init__()
        self.system = SimulatedSystem()
        self.stalled = False
        self.watchdog = VirtualWatchdog(self.system)
        self.core = OperatorSide(2, "clock")
        self.robot = LinkEnd("robot", 1, "clock")
        self.search = VirtualSearch(Finder(self.system), lambda: self.stalled)
        self.connection = Connection(self.search, self, self.watchdog)
        self.armed = False
        self.strength = 7
        self.commanded_s = self.report_s = 0.0
        self.must_stop = self.must_release = False
        self.changes: list[str] = []
        self.stiff_since_s: dict[bytes, float] = {}

    @property
    def now_s(self) -> float:
        return self.system.clock.now()

    # Listener of the connection, which passes events on to the core

    def controller_found(self, now_s: float) -> None:
        if self.connection.found > self.changes.count("found"):
            self.changes.append("found")
        self.must_release = True
        self.core.controller_found(now_s)

    def controller_lost(self, now_s: float) -> None:
        self.changes.append("lost")
        self.must_stop = True
        self.core.controller_lost(now_s)

    # One turn of the loop

    def turn(self) -> None:
        self.pass_time(PERIOD_S)
        now_s = self.now_s
        self.armed = self.armed and now_s - self.commanded_s < 0.1
        session = SessionState.ARMED if self.armed else SessionState.DISARMED
        notice = LeaseNotice(self.robot.stamp(now_s), session=session, why="", token=7, waiting=0)
        commanded = uniform_update(
            self.robot.stamp(now_s), r2=self.strength, state="armed" if self.armed else "disarmed"
        )
        for message in (notice, commanded):
            self.core.receive(encode(message), now_s)
        self.must_stop = self.must_stop and self.armed
        self.connection.beat(now_s)
        if (output := self.core.feel_now(now_s)) is not None:
            assert output == RELEASED or not self.must_release, "told before it was released"
            self.must_release = False
            self.connection.write(output, now_s)
        self.connection.update(now_s)
        now_s = self.now_s  # Opening a controller lets time pass.
        if (state := self.connection.read(now_s)) is not None:
            controller = self.connection.controller
            assert controller is None or controller.path not in self.system.off, "a repeated state counts as new"
            self.report_s = now_s
            self.core.read_state(state, now_s)
        for command in (decode(message.payload) for message in self.core.motion(now_s)):
            if isinstance(command, MotionCommand):
                assert not self.must_stop, "commanded before the arm was known to stand"
                assert self.connection.state is ConnectionState.CONNECTED
                assert now_s - self.report_s <= INTENT_EXPIRES_S
                self.commanded_s = now_s
                self.armed |= command.arm and command.l2 == command.r2 == 0.0
        self.look_at_triggers()

    def pass_time(self, duration_s: float) -> None:
        self.system.clock.advance_to(self.now_s + duration_s)
        self.watchdog.look()

    def look_at_triggers(self) -> None:
        controller = self.connection.controller
        connected = None if controller is None else controller.path
        if connected is not None and connected in self.system.devices and not self.must_release:
            device, commanded = self.system.devices[connected], self.core.haptics.written
            writes = controller.device if controller is not None else None
            assert isinstance(writes, StallingWrites)
            if not writes.waits_since(self.now_s):
                assert device.strengths == (commanded.l2, commanded.r2), "it does not do what the core believes"
            elif writes.waits_since(self.now_s) > STALL_S + SILENCE_S + 0.1 and self.system.failing == 0:
                assert device.released, "stiff while a write hangs"
        left_stiff = [path for path, one in self.system.devices.items() if not one.released and path != connected]
        self.stiff_since_s = {path: self.stiff_since_s.get(path, self.now_s) for path in left_stiff}
        for path, since_s in self.stiff_since_s.items():
            assert self.now_s - since_s < LOOK_PERIOD_S + 0.3, f"{path!r} was left stiff"

    # Events

    @initialize()
    def begin(self) -> None:
        self.core.receive(encode(self.robot.hello(self.now_s)), self.now_s)

    @rule(path=st.sampled_from(["usb A", "bluetooth A", "usb B"]))
    def plug_or_unplug(self, path: str) -> None:
        if path.encode() in self.system.devices:
            self.system.unplug(path.encode())
            return
        transport = Transport.USB if path.startswith("usb") else Transport.BLUETOOTH
        device = SimulatedDualSense(transport, address=f"0{path[-1].lower()}:00:00:00:00:00")
        device.read(self.now_s)
        self.system.devices[path.encode()] = device

    @precondition(lambda self: self.system.devices)
    @rule()
    def switch_off_or_on(self) -> None:
        """Switch off the connected controller, whose dongle then repeats its last report, else all; or all on again."""
        connected = None if self.connection.controller is None else self.connection.controller.path
        off = {path for path in self.system.devices if connected in (None, path)}
        self.system.off = set() if self.system.off else off

    @rule(turns=st.sampled_from([1, 10, 60, 300]))
    def go_on(self, turns: int) -> None:
        for _ in range(turns):
            self.turn()

    @rule(pulled=st.booleans(), arm=st.booleans())
    def hands(self, pulled: bool, arm: bool) -> None:
        for device in self.system.devices.values():
            device.set_finger_force(0.0, 3.0 if pulled else 0.0)
            device.set_buttons(frozenset({Button.L1, Button.OPTIONS}) if arm else frozenset({Button.L1}))

    @precondition(lambda self: self.system.devices)
    @rule()
    def arm(self) -> None:
        """End the faults, connect a controller, arm the arm and make the triggers stiff."""
        self.stalled, self.system.failing, self.strength = False, 0, 7
        self.system.off.clear()
        for _ in range(2000):  # Another controller is taken after three searches.
            self.turn()
            if self.connection.state is ConnectionState.CONNECTED:
                break
        for pulled, armed, turns in ((False, False, 30), (False, True, 20), (True, False, 100)):
            self.hands(pulled, armed)
            self.go_on(turns)
        assert self.connection.state is ConnectionState.CONNECTED
        assert self.armed
        assert not self.connection.controller.device.released  # type: ignore[union-attr]

    @rule(strength=st.integers(0, 8))
    def ahead(self, strength: int) -> None:
        self.strength = strength

    @rule(count=st.integers(1, 2))  # the watchdog tries three times
    def writes_fail(self, count: int) -> None:
        self.system.failing = count

    @rule(stalled=st.booleans(), strength=st.integers(1, 8))
    def writes_hang(self, stalled: bool, strength: int) -> None:
        self.stalled, self.strength = stalled, strength
        self.go_on(150)

    @rule(duration_s=st.sampled_from([0.05, 0.15, 0.5]))
    def we_hang(self, duration_s: float) -> None:
        for _ in range(round(duration_s / 0.01)):
            self.pass_time(0.01)
        if duration_s > SILENCE_S + BEAT_PERIOD_S and not self.stalled and self.system.failing == 0:
            assert all(device.released for device in self.system.devices.values()), "stiff while nobody looks after it"

    @invariant()
    def found_and_lost_alternate_and_looks_are_rare(self) -> None:
        assert self.changes == (["found", "lost"] * len(self.changes))[: len(self.changes)]
        assert self.search.looks <= (self.now_s - 1.0) / LOOK_PERIOD_S + 1

    def teardown(self) -> None:
        self.connection.close()
        self.watchdog.release()  # As when its pipe closes.
        assert all(device.released for device in self.system.devices.values()), "left stiff at the end"


TestPlugs = Plugs.TestCase
# Without shrinking, which would take minutes.
TestPlugs.settings = settings(max_examples=60, stateful_step_count=20, phases=[Phase.explicit, Phase.generate])
