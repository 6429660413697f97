from dataclasses import dataclass

import pytest

from common.errors import DeviceError, NoDeviceError, NoDriverError
from common.status.codes import ConnectionState
from operator_side.controller.connection import BEAT_PERIOD_S, LOOK_PERIOD_S, REWRITE_AFTER_S, Connection
from operator_side.controller.feel import Feel
from operator_side.controller.port import OpenController
from operator_side.controller.search import BackgroundSearch
from operator_side.controller.silence import SILENT_S
from operator_side.controller.state import ControllerState
from tests.helpers.messages import feedback

PERIOD_S = 0.004
STIFF = Feel(r2=feedback(3, 6))


@dataclass
class FakeDevice:
    log: list[str]
    plugged_in: bool = True
    released: bool = True
    speaks: bool = True

    def read(self, now_s: float) -> ControllerState | None:
        del now_s
        self._check()
        return ControllerState() if self.speaks else None

    def write(self, output: Feel, now_s: float) -> None:
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


class FakeSearch(BackgroundSearch):
    """Search whose next result the test chooses."""

    def __init__(self) -> None:
        self.result: OpenController | DeviceError | None = NoDeviceError("no controller found")
        self.looks: list[str | None] = []
        self.looking = self.closed = False

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
    """Connection with a fake search, listener and watchdog, whose calls are listed in `log`."""

    def __init__(self) -> None:
        self.log: list[str] = []
        self.search = FakeSearch()
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


def test_the_first_search_is_at_once_then_once_a_second_and_a_missing_controller_is_noted_once(world: World) -> None:
    world.run(PERIOD_S)
    assert len(world.search.looks) == 1
    world.run(10.0)
    assert 10 <= len(world.search.looks) <= 11
    assert world.connection.state is ConnectionState.ABSENT
    assert world.connection.take_notes() == ["no controller found; waiting for a controller"]
    assert (world.connection.read(world.now_s), world.connection.write(STIFF, world.now_s)) == (None, False)
    world.plug_in()
    world.run(LOOK_PERIOD_S + PERIOD_S)
    assert world.connection.take_notes() == ["controller: DualSense on USB"]
    looks = len(world.search.looks)
    world.run(5.0)
    assert len(world.search.looks) == looks


def test_the_watchdog_gets_the_hold_before_any_write_and_beats_while_an_effect_is_on(world: World) -> None:
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
    world.now_s += 10.0  # A silence at rest does not count.
    world.run(1.0)
    world.connection.write(STIFF, world.now_s)
    assert world.log == ["rest", "beat", "write"]


@pytest.mark.parametrize("noticed_by", ["reading", "writing"])
def test_unplugged_it_is_lost_at_once_and_looked_for_a_second_later(world: World, noticed_by: str) -> None:
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
    assert "release its triggers and arm again" in note
    world.run(LOOK_PERIOD_S - 2 * PERIOD_S)
    assert len(world.search.looks) == looks
    world.run(5.0)
    assert set(world.search.looks[looks:]) == {"aa"}
    assert world.connection.take_notes() == []


def test_without_a_new_state_it_is_lost_as_if_unplugged(world: World) -> None:
    device = world.plug_in()
    device.speaks = False
    world.run(1.0)  # Nothing is expected before the first state.
    device.speaks = True
    world.run(PERIOD_S)
    world.connection.take_notes()
    device.speaks = False
    for wait_s, state in ((SILENT_S - PERIOD_S, ConnectionState.CONNECTED), (2 * PERIOD_S, ConnectionState.LOST)):
        world.run(wait_s)
        assert world.connection.state is state
    assert world.log[-3:] == ["lost", "close", "let go"]
    [note] = world.connection.take_notes()
    assert "no new report for 0.15 s" in note
    assert "release its triggers and arm again" in note
    device.speaks = True
    world.run(LOOK_PERIOD_S + 2 * PERIOD_S)
    assert world.connection.state is ConnectionState.CONNECTED


@pytest.mark.parametrize("stall_s", [0.3, 100.0])
def test_a_stall_of_ours_is_no_silence_of_the_controller(world: World, stall_s: float) -> None:
    device = world.connected()
    for _ in range(5):
        world.now_s += stall_s
        for device.speaks in (False, False, True):  # What came meanwhile may be read later.
            world.run(PERIOD_S)
    assert world.connection.state is ConnectionState.CONNECTED


@pytest.mark.parametrize(
    ("before", "after", "note"),
    [
        ("aa", "aa", "controller: DualSense on USB, back again"),
        ("aa", "bb", "another controller: DualSense on USB"),
        ("aa", None, "controller: DualSense on USB"),
        (None, "bb", "controller: DualSense on USB"),
    ],
)
def test_a_return_is_recognised_by_the_address(world: World, before: str | None, after: str | None, note: str) -> None:
    device = world.plug_in(before)
    world.run(2 * PERIOD_S)
    world.unplug(device)
    world.run(1.5)
    world.connection.take_notes()
    world.log.clear()
    world.plug_in(after)
    world.run(LOOK_PERIOD_S + PERIOD_S)
    assert world.connection.take_notes() == [note]
    assert world.log == ["hold /dev/hidraw3 off", "found"]
    assert world.connection.found == 2


def test_each_trouble_is_said_once_and_looked_at_again(world: World) -> None:
    # The system grants permission a moment after a controller appears, so a single refusal is not noted.
    world.search.result = DeviceError("no permission")
    world.run(PERIOD_S + LOOK_PERIOD_S / 2)
    assert world.connection.take_notes() == []
    denied, other = DeviceError("no permission"), DeviceError("in use")
    for result in (denied, other, denied, NoDeviceError("none"), denied):
        world.search.result = result
        world.run(2 * LOOK_PERIOD_S)
    assert [note.partition(";")[0] for note in world.connection.take_notes()] == ["no permission", "in use", "none"]
    world.search.result = None  # A search that takes its time.
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


def test_after_a_silence_the_triggers_are_told_anew(world: World) -> None:
    world.connected()
    world.connection.write(STIFF, world.now_s)
    world.run(1.0)
    world.log.clear()
    world.now_s += REWRITE_AFTER_S
    world.run(PERIOD_S)
    assert world.log == ["beat", "found"]
    assert world.connection.found == 1
