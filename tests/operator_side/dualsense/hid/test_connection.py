"""A controller that comes and goes, in virtual time, with a search and devices in the test's hands."""

from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DeviceError, NoDeviceError, NoDriverError
from operator_side.dualsense.hid.connection import (
    BEAT_PERIOD_S,
    LOOK_PERIOD_S,
    RETELL_AFTER_S,
    TABLE,
    Connection,
    ConnectionEvent,
    ConnectionState,
)
from operator_side.dualsense.hid.port import OpenController

TICK_S = 0.004


@dataclass
class FakeDevice:
    """A controller that can be unplugged."""

    log: list[str]
    plugged_in: bool = True
    released: bool = True

    def read(self, now_s: float) -> bytes | None:
        self._check()
        return b"%d" % round(1e3 * now_s)

    def write(self, report: bytes, now_s: float) -> None:
        del now_s
        self._check()
        self.released = False
        self.log.append(f"write {report.decode()}")

    def close(self) -> None:
        self.released = self.released or self.plugged_in
        self.log.append("close")

    def _check(self) -> None:
        if not self.plugged_in:
            raise DeviceError("the controller is gone")


@dataclass
class FakeSearch:
    """What the next look will find."""

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
    """A connection with everything around it."""

    def __init__(self) -> None:
        self.log: list[str] = []
        self.search = FakeSearch(NoDeviceError("no controller found"))
        self.connection = Connection(self.search, self, self)
        self.now_s = 10.0

    # The listener and the guard

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

    # The world

    def plug_in(self, path: str = "/dev/hidraw3") -> FakeDevice:
        device = FakeDevice(self.log)
        self.search.result = OpenController(device, "DualSense on USB", "aa", path.encode(), b"off")
        return device

    def unplug(self, device: FakeDevice) -> None:
        device.plugged_in = False
        self.search.result = NoDeviceError("no controller found")

    def run(self, duration_s: float) -> None:
        for _ in range(round(duration_s / TICK_S)):
            self.now_s += TICK_S
            self.connection.beat(self.now_s)
            self.connection.update(self.now_s)
            self.connection.read(self.now_s)

    def connected(self) -> FakeDevice:
        device = self.plug_in()
        self.run(2 * TICK_S)
        assert self.connection.state is ConnectionState.CONNECTED
        return device


@pytest.fixture
def world() -> World:
    return World()


def test_the_first_look_is_at_once_and_the_others_once_a_second(world: World) -> None:
    world.run(TICK_S)
    assert len(world.search.looks) == 1
    world.run(10.0)
    assert 10 <= len(world.search.looks) <= 11
    assert world.connection.state is ConnectionState.ABSENT


def test_that_there_is_none_is_said_once(world: World) -> None:
    world.run(5.0)
    assert world.connection.take_notes() == ["no controller found; waiting for one"]
    world.run(5.0)
    assert world.connection.take_notes() == []


def test_one_appears(world: World) -> None:
    world.run(3.5)
    world.connection.take_notes()
    world.plug_in()
    world.run(LOOK_PERIOD_S + TICK_S)
    assert world.connection.state is ConnectionState.CONNECTED
    assert world.connection.take_notes() == ["controller: DualSense on USB"]
    assert world.connection.read(world.now_s) is not None
    assert world.connection.write(b"stiff", world.now_s)


def test_the_watchdog_knows_before_anything_is_written(world: World) -> None:
    world.connected()
    world.connection.write(b"stiff", world.now_s)
    assert world.log == ["hold /dev/hidraw3 off", "found", "beat", "write stiff"]


def test_while_an_effect_is_on_it_beats_and_at_rest_it_does_not(world: World) -> None:
    device = world.connected()
    world.run(3.0)
    assert "beat" not in world.log
    world.connection.write(b"stiff", world.now_s)
    world.log.clear()
    world.run(3.0)
    assert set(world.log) == {"beat"}
    assert 0.9 * 3.0 / BEAT_PERIOD_S <= len(world.log) <= 3.0 / BEAT_PERIOD_S
    device.released = True
    world.log.clear()
    world.run(3.0)
    assert world.log == ["rest"]
    world.connection.write(b"stiff", world.now_s)
    assert world.log == ["rest", "beat", "write stiff"]


def test_after_a_silence_the_triggers_are_told_anew(world: World) -> None:
    world.connected()
    world.connection.write(b"stiff", world.now_s)
    world.run(1.0)
    world.log.clear()
    world.now_s += RETELL_AFTER_S
    world.run(TICK_S)
    assert world.log == ["beat", "found"]
    world.run(1.0)
    assert set(world.log[2:]) == {"beat"}
    assert world.connection.found == 1


def test_a_silence_at_rest_is_none(world: World) -> None:
    world.connected()
    world.log.clear()
    world.now_s += 10.0
    world.run(1.0)
    assert world.log == []


def test_a_write_that_does_not_return_is_a_silence(world: World) -> None:
    stalls = False
    device = FakeDevice(world.log)
    world.search.result = OpenController(device, "DualSense on USB", "aa", b"/dev/hidraw3", b"off", lambda _: stalls)
    world.run(2 * TICK_S)
    world.connection.write(b"stiff", world.now_s)
    world.connection.take_notes()
    world.log.clear()
    stalls = True
    world.run(3.0)
    assert world.log == []
    [note] = world.connection.take_notes()
    assert "does not return" in note
    stalls = False
    world.run(TICK_S)
    assert world.log == ["beat", "found"]


def test_what_nobody_watches_over_gets_no_beats(world: World) -> None:
    world.search.result = OpenController(FakeDevice(world.log), "simulated DualSense")
    world.run(1.0)
    world.connection.write(b"stiff", world.now_s)
    world.run(1.0)
    assert world.log == ["found", "write stiff"]


def test_no_look_while_there_is_one(world: World) -> None:
    world.connected()
    looks = len(world.search.looks)
    world.run(5.0)
    assert len(world.search.looks) == looks


@pytest.mark.parametrize("noticed_by", ["reading", "writing"])
def test_unplugged_it_is_lost_at_once_and_looked_for_a_second_later(world: World, noticed_by: str) -> None:
    device = world.connected()
    world.connection.take_notes()
    looks = len(world.search.looks)
    world.unplug(device)
    if noticed_by == "reading":
        assert world.connection.read(world.now_s) is None
    else:
        assert not world.connection.write(b"stiff", world.now_s)
    assert world.connection.state is ConnectionState.LOST
    assert world.log[-3:] == ["lost", "close", "let go"]
    [note] = world.connection.take_notes()
    assert "the controller is gone" in note
    assert "release the triggers and arm it anew" in note
    world.run(LOOK_PERIOD_S - 2 * TICK_S)
    assert len(world.search.looks) == looks
    world.run(3 * TICK_S)
    assert world.search.looks[looks:] == ["aa"]
    world.run(5.0)
    assert world.connection.take_notes() == []


def test_without_a_controller_nothing_is_read_or_written(world: World) -> None:
    world.run(2.0)
    assert world.connection.read(world.now_s) is None
    assert not world.connection.write(b"stiff", world.now_s)
    assert world.log == []


def test_it_comes_back(world: World) -> None:
    world.unplug(world.connected())
    world.run(1.5)
    world.connection.take_notes()
    world.plug_in("/dev/hidraw7")
    world.log.clear()
    world.run(LOOK_PERIOD_S + TICK_S)
    assert world.log == ["hold /dev/hidraw7 off", "found"]
    assert world.connection.take_notes() == ["controller: DualSense on USB, back again"]
    assert world.connection.found == 2


@pytest.mark.parametrize(
    ("before", "after", "note"),
    [
        ("aa", "bb", "another controller: DualSense on USB"),
        ("aa", None, "controller: DualSense on USB"),
        (None, "bb", "controller: DualSense on USB"),
        (None, None, "controller: DualSense on USB"),
    ],
)
def test_only_the_same_one_comes_back(world: World, before: str | None, after: str | None, note: str) -> None:
    device = FakeDevice(world.log)
    world.search.result = OpenController(device, "DualSense on USB", before)
    world.run(2 * TICK_S)
    world.unplug(device)
    world.run(1.5)
    world.connection.take_notes()
    world.search.result = OpenController(FakeDevice(world.log), "DualSense on USB", after)
    world.run(LOOK_PERIOD_S + TICK_S)
    assert world.connection.take_notes() == [note]


def test_each_trouble_is_said_once_and_looked_at_again(world: World) -> None:
    denied, other = DeviceError("no permission"), DeviceError("in use")
    for result in (denied, other, denied, NoDeviceError("none"), denied):
        world.search.result = result
        world.run(2 * LOOK_PERIOD_S)
    assert [note.partition(";")[0] for note in world.connection.take_notes()] == ["no permission", "in use", "none"]
    world.plug_in()
    world.run(1.5)
    assert world.connection.state is ConnectionState.CONNECTED


def test_a_controller_that_is_refused_while_the_system_still_sets_it_up_is_no_trouble(world: World) -> None:
    world.run(0.5)
    world.connection.take_notes()
    world.search.result = DeviceError("no permission")
    world.run(LOOK_PERIOD_S)
    world.plug_in()
    world.run(LOOK_PERIOD_S)
    assert len(world.search.looks) == 3
    assert world.connection.take_notes() == ["controller: DualSense on USB"]


def test_what_no_waiting_mends_is_raised(world: World) -> None:
    world.search.result = NoDriverError("hidapi is missing")
    with pytest.raises(NoDriverError, match="hidapi is missing"):
        world.run(1.0)


def test_a_slow_search_is_waited_for(world: World) -> None:
    world.search.result = None
    world.run(3.0)
    assert (world.connection.state, len(world.search.looks)) == (ConnectionState.ABSENT, 3)
    world.plug_in()
    world.run(TICK_S)
    assert world.connection.found == 1


def test_closing_releases_and_tells_the_watchdog(world: World) -> None:
    device = world.connected()
    world.connection.write(b"stiff", world.now_s)
    world.connection.close()
    world.connection.close()
    assert world.log[-2:] == ["close", "let go"]
    assert world.search.closed
    assert world.connection.released
    assert device.released
    looks = len(world.search.looks)
    world.run(3.0)
    assert len(world.search.looks) == looks


def test_what_could_not_be_released_stays_with_the_watchdog(world: World) -> None:
    device = world.connected()
    world.connection.write(b"stiff", world.now_s)
    world.unplug(device)
    world.run(TICK_S)
    world.connection.close()
    assert "let go" not in world.log
    assert not world.connection.released


def test_the_table_names_every_pair_that_can_happen() -> None:
    waiting = {ConnectionEvent.OPENED, ConnectionEvent.NONE_FOUND, ConnectionEvent.REFUSED}
    possible = {(state, event) for state in ConnectionState for event in waiting}
    possible -= {(ConnectionState.CONNECTED, event) for event in waiting}
    assert set(TABLE) == possible | {(ConnectionState.CONNECTED, ConnectionEvent.GONE)}


@given(st.lists(st.sampled_from(["plug in", "unplug", "deny", "write", "wait", "wait long"]), max_size=40))
@settings(derandomize=True, deadline=None)
def test_whatever_happens_found_and_lost_alternate_and_looks_are_rare(steps: list[str]) -> None:
    world = World()
    device: FakeDevice | None = None
    for step in steps:
        if step == "plug in" and device is None:
            device = world.plug_in()
        elif step == "unplug" and device is not None:
            world.unplug(device)
            device = None
        elif step == "deny" and device is None:
            world.search.result = DeviceError("no permission")
        elif step == "write":
            world.connection.write(b"stiff", world.now_s)
        else:
            world.run(1.7 if step == "wait long" else 0.1)
    changes = [entry for entry in world.log if entry in ("found", "lost")]
    assert changes == (["found", "lost"] * len(changes))[: len(changes)]
    assert len(world.search.looks) <= (world.now_s - 10.0) / LOOK_PERIOD_S + 1
    world.connection.close()
    opened = world.log.count("found")
    assert world.log.count("close") == opened
