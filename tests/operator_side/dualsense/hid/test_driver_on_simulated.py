"""The whole driver on the simulated controller: it checks our checksums and decodes our effects."""

from typing import Any

import pytest

from common.clock import VirtualClock
from common.errors import DeviceError
from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from operator_side.core import OperatorSide
from operator_side.dualsense.hid.connection import LOOK_PERIOD_S, Connection, ConnectionState
from operator_side.dualsense.hid.device import HidDualSense, HidHandle
from operator_side.dualsense.hid.finding import find_controller
from operator_side.dualsense.hid.port import OpenController
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.models import SONY_VENDOR_ID, Model
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SIMULATED_FIRMWARE, SimulatedDualSense
from tests.helpers.felt import felt

PERIOD_S = 0.004
USB, BLUETOOTH = Transport.USB, Transport.BLUETOOTH


class SimulatedHandle:
    """hidapi's handle on a simulated controller: errors as hidapi's, and waiting lets virtual time pass."""

    def __init__(self, system: "SimulatedSystem") -> None:
        self._system = system
        self._device: SimulatedDualSense | None = None

    def open_path(self, path: bytes) -> None:
        self._device = self._system.devices.get(path)
        if self._device is None:
            raise OSError("open failed")

    def set_nonblocking(self, flag: int) -> int:
        return flag

    def read(self, max_length: int, timeout_ms: int = 0) -> list[int]:
        if timeout_ms > 0:
            self._system.clock.advance_to(self._system.clock.now() + PERIOD_S)
        try:
            return list((self._open().read(self._system.clock.now()) or b"")[:max_length])
        except DeviceError as error:
            raise OSError("read error") from error

    def write(self, data: bytes) -> int:
        try:
            self._open().write(data, self._system.clock.now())
        except DeviceError:
            return -1
        return len(data)

    def get_feature_report(self, report_num: int, max_length: int) -> list[int]:
        try:
            return list(self._open().get_feature(report_num)[:max_length])
        except DeviceError as error:
            raise OSError("read error") from error

    def close(self) -> None:
        self._device = None

    def error(self) -> str:
        return "No such file or directory"

    def _open(self) -> SimulatedDualSense:
        assert self._device is not None
        return self._device


class SimulatedSystem:
    """hidapi on a machine with simulated controllers."""

    def __init__(self, **devices: SimulatedDualSense) -> None:
        self.clock = VirtualClock(1.0)
        self.devices = {f"/dev/{name}".encode(): device for name, device in devices.items()}

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        assert vendor_id == SONY_VENDOR_ID
        return [{"path": path} for path, device in self.devices.items() if device.model.value == product_id]

    def device(self) -> HidHandle:
        return SimulatedHandle(self)


class Search:
    """A look that needs no thread."""

    def __init__(self, system: SimulatedSystem) -> None:
        self._system = system
        self._result: OpenController | DeviceError | None = None

    def begin(self, preferred: str | None) -> None:
        try:
            self._result = find_controller(self._system, preferred)
        except DeviceError as error:
            self._result = error

    def take(self) -> OpenController | DeviceError | None:
        result, self._result = self._result, None
        return result

    def close(self) -> None:
        pass


@pytest.mark.parametrize("model", list(Model))
@pytest.mark.parametrize("transport", list(Transport))
def test_it_is_known_for_what_it_is(transport: Transport, model: Model) -> None:
    simulated = SimulatedDualSense(transport, model)
    assert simulated.simple_mode is (transport is BLUETOOTH)
    system = SimulatedSystem(hidraw3=simulated)
    device = HidDualSense(system, b"/dev/hidraw3")
    assert not simulated.simple_mode
    identity = device.identity
    assert (identity.transport, identity.address) == (transport, simulated.address)
    assert identity.firmware == SIMULATED_FIRMWARE
    state = parse_input_report(identity.first_report, identity.motion)
    assert state.acceleration_m_s2 is not None
    assert sum(axis**2 for axis in state.acceleration_m_s2) ** 0.5 == pytest.approx(9.81, abs=0.02)


class Run:
    """The operator side's core on a system with controllers, told a stiffness every 4 ms."""

    def __init__(self, system: SimulatedSystem) -> None:
        self.system = system
        self.core = OperatorSide(2, "clock")
        self.robot = LinkEnd("robot", 1, "clock")
        self.connection = Connection(Search(system), self.core)
        self.core.receive(encode(self.robot.hello(system.clock.now())), system.clock.now())

    def run(self, duration_s: float, r2: int = 7) -> None:
        for _ in range(round(duration_s / PERIOD_S)):
            self.system.clock.advance_to(self.system.clock.now() + PERIOD_S)
            now_s = self.system.clock.now()
            self.core.receive(encode(felt(self.robot.stamp(now_s), r2=r2)), now_s)
            self.connection.update(now_s)
            if (report := self.connection.read(now_s)) is not None:
                self.core.read_report(report, now_s)
            if (output := self.core.output_report(now_s)) is not None:
                self.connection.write(output, now_s)


@pytest.mark.parametrize("transport", list(Transport))
def test_stiffness_arrives_as_an_effect_and_leaves_with_us(transport: Transport) -> None:
    simulated = SimulatedDualSense(transport)
    run = Run(SimulatedSystem(hidraw3=simulated))
    run.run(0.2)
    assert max(simulated.effects[1].zone_strengths) > 4
    # Nothing changes, nothing is written.
    writes = simulated.write_count
    run.run(1.0)
    assert simulated.write_count == writes
    run.connection.close()
    assert simulated.released
    assert run.connection.released
    assert (simulated.bad_checksums, run.core.rejected) == (0, 0)


def test_unplugged_it_comes_back_over_the_radio_as_the_same_controller() -> None:
    wired, wireless = SimulatedDualSense(USB), SimulatedDualSense(BLUETOOTH)
    system = SimulatedSystem(hidraw3=wired)
    run = Run(system)
    run.run(0.2)
    assert not wired.released
    del system.devices[b"/dev/hidraw3"]
    wired.unplug()
    run.run(0.1)
    assert run.connection.state is ConnectionState.LOST
    system.devices[b"/dev/hidraw5"] = wireless
    run.run(LOOK_PERIOD_S + 0.2)
    assert run.connection.controller is not None
    assert run.connection.controller.address == wired.address
    assert "Bluetooth" in run.connection.controller.name
    assert max(wireless.effects[1].zone_strengths) > 4
    assert wireless.bad_checksums == 0


def test_both_ways_at_once_are_one_controller_on_usb() -> None:
    wired, wireless = SimulatedDualSense(USB), SimulatedDualSense(BLUETOOTH)
    run = Run(SimulatedSystem(hidraw3=wireless, hidraw4=wired))
    run.run(0.2)
    assert not wired.released
    assert wireless.write_count == 0


@pytest.mark.parametrize("transport", list(Transport))
def test_what_the_watchdog_is_given_releases_it(transport: Transport) -> None:
    simulated = SimulatedDualSense(transport)
    run = Run(SimulatedSystem(hidraw3=simulated))
    run.run(0.2)
    assert not simulated.released
    assert run.connection.controller is not None
    simulated.write(run.connection.controller.release, run.system.clock.now())
    assert simulated.released
    assert simulated.bad_checksums == 0
