"""Simulated machine in virtual time: hidapi with controllers, the search, background writes, the watchdog."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from common.clock import VirtualClock
from common.errors import DeviceError
from operator_side.controller.background_writes import STALL_S
from operator_side.controller.feel import RELEASED, Feel
from operator_side.controller.port import Controller, OpenController
from operator_side.controller.search import BackgroundSearch
from operator_side.controller.state import ControllerState
from operator_side.dualsense.hid.device import HidHandle
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.dualsense.hid.release_watchdog import SILENCE_S
from operator_side.dualsense.reports.models import SONY_VENDOR_ID
from operator_side.dualsense.simulated.controller import SimulatedDualSense

PERIOD_S = 0.004


class SimulatedHandle:
    """Stand-in for hidapi's `device`, with hidapi's errors. A read that waits advances virtual time."""

    def __init__(self, system: "SimulatedSystem") -> None:
        self._system = system
        self._path = b""
        self._repeated_s = -1.0
        self._device: SimulatedDualSense | None = None

    def open_path(self, path: bytes) -> None:
        self._path, self._device = path, self._system.devices.get(path)
        if self._device is None:
            raise OSError("open failed")

    def set_nonblocking(self, flag: int) -> int:
        return flag

    def read(self, max_length: int, timeout_ms: int = 0) -> list[int]:
        try:
            report = self._report()
            if report is None and timeout_ms > 0:
                self._system.clock.advance_to(self._system.clock.now() + PERIOD_S)
                report = self._report()
        except DeviceError as error:
            raise OSError("read error") from error
        return list((report or b"")[:max_length])

    def write(self, data: bytes) -> int:
        try:
            return len(data) if self._system.transfer(self._open(), data) else -1
        except DeviceError:
            return -1

    def get_feature_report(self, report_num: int, max_length: int) -> list[int]:
        try:
            return list(self._open().get_feature(report_num)[:max_length])
        except DeviceError as error:
            raise OSError("read error") from error

    def close(self) -> None:
        self._device = None

    def error(self) -> str:
        return "No such file or directory"

    def _report(self) -> bytes | None:
        """Return a report if there is one; of a controller that is off, its last one, once at each time."""
        now_s, device = self._system.clock.now(), self._open()
        if self._path not in self._system.off:
            self._repeated_s, report = now_s, device.read_report(now_s)
            self._system.last[self._path] = report or self._system.last.get(self._path, b"")
            return report
        before_s, self._repeated_s = self._repeated_s, now_s
        return self._system.last[self._path] if now_s > before_s else None

    def _open(self) -> SimulatedDualSense:
        assert self._device is not None
        if self._system.devices.get(self._path) is not self._device:
            raise DeviceError("unplugged")
        return self._device


class SimulatedSystem:
    """Stand-in for the module hidapi, with the plugged-in controllers by path.

    A controller that is plugged in again is another object.
    """

    def __init__(self) -> None:
        self.clock = VirtualClock(1.0)
        self.devices: dict[bytes, SimulatedDualSense] = {}
        self.off: set[bytes] = set()
        """Dongles whose controller is off or out of reach: they repeat its last report for ever."""
        self.last: dict[bytes, bytes] = {}
        self.failing = 0
        """Number of next transfers, to any controller, that will fail."""

    def unplug(self, path: bytes) -> None:
        """Remove the controller at `path`; without power its triggers are released."""
        self.off.discard(path)
        self.devices.pop(path).write(RELEASED, self.clock.now())

    def transfer(self, device: SimulatedDualSense, report: bytes) -> bool:
        """Give an output report to a controller; return False if the transfer failed."""
        if self.failing > 0:
            self.failing -= 1
            return False
        if device in self.devices.values():
            device.apply_report(report, self.clock.now())
        return device in self.devices.values()

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        assert vendor_id == SONY_VENDOR_ID
        return [{"path": path} for path, device in self.devices.items() if device.model.value == product_id]

    def device(self) -> HidHandle:
        return SimulatedHandle(self)


class StallingWrites:
    """BackgroundWrites without a thread: a write while `stalled()` is made once the stall has ended."""

    def __init__(self, device: Controller, stalled: Callable[[], bool]) -> None:
        self._device = device
        self._stalled = stalled
        self._waiting: Feel | None = None
        self._since_s = 0.0
        self._stuck = False

    @property
    def released(self) -> bool:
        return self._waiting is None and not self._stuck and self._device.released

    def stalls(self, now_s: float) -> bool:
        return self._waiting is not None and now_s - self._since_s > STALL_S

    def waits_since(self, now_s: float) -> float:
        """Return the seconds for which a write has been waiting; 0 if none waits."""
        return 0.0 if self._waiting is None else max(now_s - self._since_s, 1e-9)

    def read(self, now_s: float) -> ControllerState | None:
        if not self._stalled() and (waiting := self._waiting) is not None:
            self._waiting = None
            self._device.write(waiting, now_s)
        return self._device.read(now_s)

    def write(self, output: Feel, now_s: float) -> None:
        if not self._stalled():
            self._device.write(output if self._waiting is None else output.completed_from(self._waiting), now_s)
            self._waiting = None
            return
        self._since_s = now_s if self._waiting is None else self._since_s
        self._waiting = output if self._waiting is None else output.completed_from(self._waiting)

    def close(self) -> None:
        self._waiting, self._stuck = None, self._stalled()
        if not self._stuck:
            self._device.close()


class VirtualSearch(BackgroundSearch):
    """Search without a thread: `begin` finds at once."""

    def __init__(self, find: Callable[[str | None], OpenController], stalled: Callable[[], bool]) -> None:
        self.looks = 0
        self._find = find
        self._stalled = stalled
        self._taken: OpenController | DeviceError | None = None

    def begin(self, preferred: str | None) -> None:
        self.looks += 1
        try:
            found = self._find(preferred)
        except DeviceError as error:
            self._taken = error
            return
        writes = StallingWrites(found.device, self._stalled)
        self._taken = replace(found, device=writes, stalls=writes.stalls)

    def take(self) -> OpenController | DeviceError | None:
        taken, self._taken = self._taken, None
        return taken

    def close(self) -> None:
        pass


class VirtualWatchdog(ReleaseGuard):
    """Release watchdog in virtual time, without its process, which test_release_watchdog.py tests."""

    def __init__(self, system: SimulatedSystem) -> None:
        self._holds: tuple[SimulatedDualSense, bytes] | None = None
        self._system = system
        self._deadline_s: float | None = None

    def hold(self, path: bytes, release: bytes) -> None:
        # A controller that was found may be unplugged before it is held.
        device = self._system.devices.get(path)
        self._holds, self._deadline_s = None if device is None else (device, release), None

    def let_go(self) -> None:
        self._holds = self._deadline_s = None

    def beat(self) -> None:
        self._deadline_s = self._system.clock.now() + SILENCE_S

    def rest(self) -> None:
        self._deadline_s = None

    def look(self) -> None:
        if self._deadline_s is not None and self._system.clock.now() >= self._deadline_s:
            self.release()

    def release(self) -> None:
        """Write the report that releases the held controller, in up to three attempts."""
        self._deadline_s = None
        if self._holds is not None:
            any(self._system.transfer(*self._holds) for _ in range(3))
