"""A controller that comes and goes, in virtual time: notices, looks, and no trigger left stiff."""

from dataclasses import dataclass, field

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from common.errors import DeviceError, NoDeviceError, NoDriverError
from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import LeaseNotice, MotionCommand
from common.protocol.session import SessionState
from operator_side.core import INTENT_EXPIRES_S, OperatorSide
from operator_side.dualsense.hid.background_writes import STALL_S
from operator_side.dualsense.hid.connection import (
    BEAT_PERIOD_S,
    LOOK_PERIOD_S,
    RETELL_AFTER_S,
    Connection,
    ConnectionState,
)
from operator_side.dualsense.hid.finding import Finder
from operator_side.dualsense.hid.port import OpenController
from operator_side.dualsense.hid.release_watchdog import SILENCE_S
from operator_side.dualsense.reports.controller_state import Button
from operator_side.dualsense.reports.output_report import RELEASED, OutputReport
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from tests.helpers.felt import feedback, felt
from tests.operator_side.dualsense.simulated_system import (
    PERIOD_S,
    SimulatedSystem,
    StallingWrites,
    VirtualSearch,
    VirtualWatchdog,
)

STIFF = OutputReport(r2=feedback(3, 6))


@dataclass
class FakeDevice:
    """A controller that can be unplugged."""

    log: list[str]
    plugged_in: bool = True
    released: bool = True

    def read(self, now_s: float) -> bytes | None:
        self._check()
        return b"%d" % round(1e3 * now_s)

    def write(self, output: OutputReport, now_s: float) -> None:
        del output, now_s
        self._check()
        self.released = False
        self.log.append("write")

    def close(self) -> None:
        self.released = self.released or self.plugged_in
        self.log.append("close")

    def _check(self) -> None:
        if not self.plugged_in:
            raise DeviceError("the controller is gone")


@dataclass
class FakeSearch:
    """A search whose next result is chosen."""

    result: OpenController | DeviceError | None = None
    looks: list[str | None] = field(default_factory=list)
    looking: bool = False
    closed: bool = False

    def begin(self, preferred: str | None) -> None:
        self.looks.append(preferred)
        self.looking = True

    def take(self) -> OpenController | DeviceError | None:
        if not self.looking or self.result is None:
            return None
        self.looking = False
        return self.result

    def close(self) -> None:
        self.closed = True


class World:
    """A connection whose search, listener and guard are in the test's hands; `log` is what they were told."""

    def __init__(self) -> None:
        self.log: list[str] = []
        self.search = FakeSearch(NoDeviceError("no controller found"))
        self.connection = Connection(self.search, self, self)
        self.now_s = 10.0

    def controller_found(self, now_s: float) -> None:
        del now_s
        self.log.append("found")

    def controller_lost(self, now_s: float) -> None:
        del now_s
        self.log.append("lost")

    def hold(self, path: bytes, release: bytes) -> None:
        self.log.append(f"hold {path.decode()} {release.decode()}")

    def let_go(self) -> None:
        self.log.append("let go")

    def beat(self) -> None:
        self.log.append("beat")

    def rest(self) -> None:
        self.log.append("rest")

    def plug_in(self, address: str | None = "aa") -> FakeDevice:
        device = FakeDevice(self.log)
        self.search.result = OpenController(device, "DualSense on USB", address, b"/dev/hidraw3", b"off")
        return device

    def unplug(self, device: FakeDevice) -> None:
        device.plugged_in = False
        self.search.result = NoDeviceError("no controller found")

    def run(self, duration_s: float) -> None:
        for _ in range(round(duration_s / PERIOD_S)):
            self.now_s += PERIOD_S
            self.connection.beat(self.now_s)
            self.connection.update(self.now_s)
            self.connection.read(self.now_s)

    def connected(self) -> FakeDevice:
        device = self.plug_in()
        self.run(2 * PERIOD_S)
        assert self.connection.state is ConnectionState.CONNECTED
        return device


@pytest.fixture
def world() -> World:
    return World()


def test_the_first_look_is_at_once_the_others_once_a_second_and_that_there_is_none_is_said_once(world: World) -> None:
    world.run(PERIOD_S)
    assert len(world.search.looks) == 1
    world.run(10.0)
    assert 10 <= len(world.search.looks) <= 11
    assert world.connection.state is ConnectionState.ABSENT
    assert world.connection.take_notes() == ["no controller found; waiting for one"]
    assert (world.connection.read(world.now_s), world.connection.write(STIFF, world.now_s)) == (None, False)
    world.plug_in()
    world.run(LOOK_PERIOD_S + PERIOD_S)
    assert world.connection.take_notes() == ["controller: DualSense on USB"]
    looks = len(world.search.looks)
    world.run(5.0)
    assert len(world.search.looks) == looks


def test_the_watchdog_knows_before_anything_is_written_and_hears_of_us_while_an_effect_is_on(world: World) -> None:
    device = world.connected()
    world.run(3.0)
    assert world.connection.write(STIFF, world.now_s)
    assert world.log == ["hold /dev/hidraw3 off", "found", "beat", "write"]
    world.log.clear()
    world.run(3.0)
    assert set(world.log) == {"beat"}
    assert 0.9 * 3.0 / BEAT_PERIOD_S <= len(world.log) <= 3.0 / BEAT_PERIOD_S
    device.released = True
    world.log.clear()
    world.run(3.0)
    assert world.log == ["rest"]
    world.now_s += 10.0  # a silence at rest is none
    world.run(1.0)
    world.connection.write(STIFF, world.now_s)
    assert world.log == ["rest", "beat", "write"]


def test_after_a_silence_the_triggers_are_told_anew(world: World) -> None:
    world.connected()
    world.connection.write(STIFF, world.now_s)
    world.run(1.0)
    world.log.clear()
    world.now_s += RETELL_AFTER_S
    world.run(PERIOD_S)
    assert world.log == ["beat", "found"]
    world.run(1.0)
    assert set(world.log[2:]) == {"beat"}
    assert world.connection.found == 1


def test_a_write_that_does_not_return_is_a_silence(world: World) -> None:
    stalls = False
    device = FakeDevice(world.log)
    world.search.result = OpenController(device, "DualSense on USB", "aa", b"/dev/hidraw3", b"off", lambda _: stalls)
    world.run(2 * PERIOD_S)
    world.connection.write(STIFF, world.now_s)
    world.connection.take_notes()
    world.log.clear()
    stalls = True
    world.run(3.0)
    assert world.log == []
    [note] = world.connection.take_notes()
    assert "does not return" in note
    stalls = False
    world.run(PERIOD_S)
    assert world.log == ["beat", "found"]


def test_what_nobody_watches_over_gets_no_beats(world: World) -> None:
    world.search.result = OpenController(FakeDevice(world.log), "simulated DualSense")
    world.run(1.0)
    world.connection.write(STIFF, world.now_s)
    world.run(1.0)
    assert world.log == ["found", "write"]


@pytest.mark.parametrize("noticed_by", ["reading", "writing"])
def test_unplugged_it_is_lost_at_once_looked_for_a_second_later_and_comes_back(world: World, noticed_by: str) -> None:
    device = world.connected()
    world.connection.take_notes()
    looks = len(world.search.looks)
    world.unplug(device)
    if noticed_by == "reading":
        assert world.connection.read(world.now_s) is None
    else:
        assert not world.connection.write(STIFF, world.now_s)
    assert world.connection.state is ConnectionState.LOST
    assert world.log[-3:] == ["lost", "close", "let go"]
    [note] = world.connection.take_notes()
    assert "the controller is gone" in note
    assert "release the triggers and arm it anew" in note
    world.run(LOOK_PERIOD_S - 2 * PERIOD_S)
    assert len(world.search.looks) == looks
    world.run(3 * PERIOD_S)
    assert world.search.looks[looks:] == ["aa"]
    world.run(5.0)
    assert world.connection.take_notes() == []
    world.plug_in()
    world.log.clear()
    world.run(LOOK_PERIOD_S + PERIOD_S)
    assert world.log == ["hold /dev/hidraw3 off", "found"]
    assert world.connection.take_notes() == ["controller: DualSense on USB, back again"]
    assert world.connection.found == 2


@pytest.mark.parametrize(
    ("before", "after", "note"),
    [
        ("aa", "bb", "another controller: DualSense on USB"),
        ("aa", None, "controller: DualSense on USB"),
        (None, "bb", "controller: DualSense on USB"),
    ],
)
def test_only_the_same_one_comes_back(world: World, before: str | None, after: str | None, note: str) -> None:
    device = world.plug_in(before)
    world.run(2 * PERIOD_S)
    world.unplug(device)
    world.run(1.5)
    world.connection.take_notes()
    world.plug_in(after)
    world.run(LOOK_PERIOD_S + PERIOD_S)
    assert world.connection.take_notes() == [note]


def test_each_trouble_is_said_once_and_looked_at_again(world: World) -> None:
    # The system gives permission a moment after a controller appears: once is no trouble yet.
    world.search.result = DeviceError("no permission")
    world.run(PERIOD_S + LOOK_PERIOD_S / 2)
    assert world.connection.take_notes() == []
    denied, other = DeviceError("no permission"), DeviceError("in use")
    for result in (denied, other, denied, NoDeviceError("none"), denied):
        world.search.result = result
        world.run(2 * LOOK_PERIOD_S)
    assert [note.partition(";")[0] for note in world.connection.take_notes()] == ["no permission", "in use", "none"]
    world.search.result = None  # a look that takes its time
    world.run(3.0)
    world.plug_in()
    world.run(PERIOD_S)
    assert world.connection.state is ConnectionState.CONNECTED


def test_what_no_waiting_mends_is_raised(world: World) -> None:
    world.search.result = NoDriverError("hidapi is missing")
    with pytest.raises(NoDriverError, match="hidapi is missing"):
        world.run(1.0)


@pytest.mark.parametrize("unplugged", [False, True])
def test_closing_releases_or_leaves_it_to_the_watchdog(world: World, unplugged: bool) -> None:
    device = world.connected()
    world.connection.write(STIFF, world.now_s)
    if unplugged:
        world.unplug(device)
        world.run(PERIOD_S)
    world.connection.close()
    world.connection.close()
    assert world.search.closed
    assert (device.released, world.connection.released, "let go" in world.log) == (not unplugged,) * 3
    looks = len(world.search.looks)
    world.run(3.0)
    assert len(world.search.looks) == looks


class Plugs(RuleBasedStateMachine):
    """Two controllers on USB and Bluetooth, faults of the wire and of our process, and the operator side's core.

    The robot side's end grants the lease and sends fields; it arms when it is asked to by released triggers, and
    disarms when commands stop for 100 ms.
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

    # The listener: passed on to the core

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
        told = felt(self.robot.stamp(now_s), r2=self.strength, state="armed" if self.armed else "disarmed")
        for message in (notice, told):
            self.core.receive(encode(message), now_s)
        self.must_stop = self.must_stop and self.armed
        self.connection.beat(now_s)
        if (output := self.core.output_report(now_s)) is not None:
            assert output == RELEASED or not self.must_release, "told before it was released"
            self.must_release = False
            self.connection.write(output, now_s)
        self.connection.update(now_s)
        now_s = self.now_s  # opening one lets time pass
        if (report := self.connection.read(now_s)) is not None:
            self.report_s = now_s
            self.core.read_report(report, now_s)
        for command in map(decode, self.core.motion(now_s)):
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
            device, told = self.system.devices[connected], self.core.haptics.written
            writes = controller.device if controller is not None else None
            assert isinstance(writes, StallingWrites)
            if not writes.waits_since(self.now_s):
                assert device.effects == (told.l2, told.r2), "it does not do what the core believes"
            elif writes.waits_since(self.now_s) > STALL_S + SILENCE_S + 0.1 and self.system.failing == 0:
                assert device.released, "stiff while a write hangs"
        left_stiff = [path for path, one in self.system.devices.items() if not one.released and path != connected]
        self.stiff_since_s = {path: self.stiff_since_s.get(path, self.now_s) for path in left_stiff}
        for path, since_s in self.stiff_since_s.items():
            assert self.now_s - since_s < LOOK_PERIOD_S + 0.3, f"{path!r} was left stiff"

    # What happens

    @initialize()
    def begin(self) -> None:
        self.core.receive(encode(self.robot.hello(self.now_s)), self.now_s)

    @rule(path=st.sampled_from(["usb A", "bluetooth A", "usb B"]))
    def plug_or_unplug(self, path: str) -> None:
        if (device := self.system.devices.pop(path.encode(), None)) is not None:
            device.unplug()
            return
        transport = Transport.USB if path.startswith("usb") else Transport.BLUETOOTH
        device = SimulatedDualSense(transport, address=f"0{path[-1].lower()}:00:00:00:00:00")
        device.read(self.now_s)
        self.system.devices[path.encode()] = device

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
        """Have stiff triggers, if a controller is there to be armed by."""
        self.stalled, self.system.failing, self.strength = False, 0, 7
        for _ in range(2000):  # another one than before is taken after three looks
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
        self.watchdog.release()  # as when its pipe closes
        assert all(device.released for device in self.system.devices.values()), "left stiff at the end"


TestPlugs = Plugs.TestCase
TestPlugs.settings = settings(
    derandomize=True,
    deadline=None,
    max_examples=60,
    stateful_step_count=20,
    phases=[Phase.explicit, Phase.generate],  # shrinking takes minutes
)
