"""Two DualSense drivers, ours and pydualsense, put through the same reports on the same simulated controller."""

import contextlib
import logging
import sys
import timeit
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

from common.errors import NoDeviceError, RemoteProtocolError
from feelahead.benchmarks.dualsense_player import CythonBackend, Player, ctypes_binding
from operator_side.core import OperatorSide
from operator_side.dualsense.attachments import TouchPoint
from operator_side.dualsense.connection import Connection, ConnectionState
from operator_side.dualsense.controller_state import ControllerState
from operator_side.dualsense.device import HidDualSense
from operator_side.dualsense.effects import DEBUG_CODES, Feedback
from operator_side.dualsense.input_report import build_input_report, parse_input_report
from operator_side.dualsense.motion_sensors import NOMINAL_MOTION
from operator_side.dualsense.output_report import OutputReport, build_output_report
from operator_side.dualsense.port import OpenController
from operator_side.dualsense.transport import Transport

REPORT_PERIOD_S: Final = 0.004
"""About 250 reports a second on USB (SDL)."""
PULLED: Final = ControllerState(
    r2=0.6,
    gyro_rad_s=(0.5, -1.0, 2.0),
    acceleration_m_s2=(3.0, 9.0, -2.0),
    touches=(TouchPoint(identity=5, x=960, y=540),),
)
"""What the controller is made to say: every axis its own value."""
_GYRO_COUNTS = NOMINAL_MOTION.gyro_counts(PULLED.gyro_rad_s or (0.0,) * 3)
_ACCELERATION_COUNTS = NOMINAL_MOTION.acceleration_counts(PULLED.acceleration_m_s2 or (0.0,) * 3)
_OUR_FLAGS: Final = (0x0F, 0x00)
"""Rumble, and an effect for either trigger; everything else belongs to the system's driver."""
_FIRST_COMMON: Final = {0x02: 1, 0x31: 2}
_FIRST_EFFECTS: Final = {Transport.USB: (11, 22), Transport.BLUETOOTH: (12, 23)}
_PLAYED_REPORTS: Final = 64
_PLUGGED_AGAIN_S: Final = 3.05
_READS_PER_S: Final = round(1.0 / REPORT_PERIOD_S)


@dataclass(frozen=True)
class Conduct:
    """What one driver did."""

    parse_s: dict[Transport, float]
    """For one input report, all that it makes of it."""
    writes_at_rest_per_s: float
    """While nobody asks for an effect."""
    axes_right: dict[Transport, bool]
    """Gyroscope and accelerometer, each axis where it belongs."""
    touch_right: dict[Transport, bool]
    corrupted_refused: bool
    """A Bluetooth report with a wrong checksum moves nothing."""
    foreign_flags: bool
    """Its writes set what belongs to others: lights, mute key, sound."""
    released_at_close: bool
    debug_codes: bool
    """Its values can make a debug code, which corrupts a trigger until it is reset."""
    after_unplug: str


class Driver(Protocol):
    """One driver under test."""

    name: str

    def examine(self, rounds: int) -> Conduct:
        """Put it through everything; each timing is the best of so many rounds."""
        ...


class Ours:
    """feelahead's driver: operator_side/dualsense with the operator side's core."""

    name = "feelahead"

    def examine(self, rounds: int) -> Conduct:
        """As the protocol says."""
        reports = {transport: _varied(transport) for transport in Transport}
        states = {transport: parse_input_report(build_input_report(PULLED, transport)) for transport in Transport}
        effects_written = self._write_effect_and_close()
        return Conduct(
            parse_s={one: best_time_s(parse_input_report, reports[one], rounds) for one in Transport},
            writes_at_rest_per_s=self._writes_at_rest_per_s(),
            axes_right={one: _ours_is_right(states[one]) for one in Transport},
            touch_right={one: states[one].touches == PULLED.touches for one in Transport},
            corrupted_refused=_refused(corrupted()),
            foreign_flags=any(_foreign(report) for report in effects_written),
            released_at_close=_ends_released(effects_written[-1], effect_places=(11, 22)),
            debug_codes=any(_encodes(code) for code in DEBUG_CODES),
            after_unplug=self._after_unplug(),
        )

    def _writes_at_rest_per_s(self) -> float:
        player = Player([build_input_report(PULLED)], endless=True)
        device = HidDualSense(CythonBackend(player), b"/dev/hidraw-player")
        core = OperatorSide(1, "bench")
        count = round(1.0 / REPORT_PERIOD_S)
        for turn in range(count):
            now_s = turn * REPORT_PERIOD_S
            if (report := device.read(now_s)) is not None:
                core.read_report(report, now_s)
            if (output := core.output_report(now_s)) is not None:
                device.write(output, now_s)
        return len(player.written) / (count * REPORT_PERIOD_S)

    def _write_effect_and_close(self) -> list[bytes]:
        player = Player([build_input_report(PULLED)], endless=True)
        device = HidDualSense(CythonBackend(player), b"/dev/hidraw-player")
        device.write(build_output_report(OutputReport(l2=Feedback(3, 6), r2=Feedback(3, 6))), 0.0)
        device.close()
        return player.written

    def _after_unplug(self) -> str:
        """Unplugged after a second, plugged in again just after a look: when it reads on."""
        search = _Plugged()
        connection = Connection(search, _Nobody())
        now_s = 0.0
        lost_s = None
        while now_s < 10.0:
            search.plugged = now_s < 1.0 or now_s >= _PLUGGED_AGAIN_S
            connection.update(now_s)
            connection.read(now_s)
            if connection.state is ConnectionState.LOST and lost_s is None:
                lost_s = now_s
            if lost_s is not None and connection.state is ConnectionState.CONNECTED:
                return f"says so, and reads on {now_s - _PLUGGED_AGAIN_S:.1f} s after it is plugged in again"
            now_s += REPORT_PERIOD_S
        return "does not read on"


class PyDualSense:
    """pydualsense as published, over the same reports instead of hardware. ModuleNotFoundError when not installed."""

    name = "pydualsense"

    def __init__(self) -> None:
        self._player = Player([build_input_report(PULLED)])
        # Its binding loads hidapi's shared library; the player stands in for it.
        before = sys.modules.get("hidapi")
        sys.modules["hidapi"] = ctypes_binding(self._player)
        level = logging.getLogger().level
        try:
            import pydualsense  # noqa: PLC0415
        finally:
            logging.getLogger().setLevel(level)
            if before is None:
                del sys.modules["hidapi"]
            else:
                sys.modules["hidapi"] = before
        self._module: Any = pydualsense.pydualsense

    def examine(self, rounds: int) -> Conduct:
        """As the protocol says."""
        readers: dict[Transport, Any] = {}
        parse_s = {}
        for transport in Transport:
            reader, _ = self._run([build_input_report(PULLED, transport)] * 2)
            parse_s[transport] = best_time_s(reader.readInput, _varied(transport), rounds)
            readers[transport], _ = self._run([build_input_report(PULLED, transport)] * 2)
        count = round(1.0 / REPORT_PERIOD_S)
        _, at_rest = self._run([build_input_report(PULLED)] * (count + 2))
        ended, left = self._left_at_close()
        bluetooth, _ = self._run([build_input_report(ControllerState(), Transport.BLUETOOTH)] * 2 + [corrupted()])
        return Conduct(
            parse_s=parse_s,
            writes_at_rest_per_s=len(at_rest) / (count * REPORT_PERIOD_S),
            axes_right={one: _theirs_is_right(readers[one].state) for one in Transport},
            touch_right={one: _their_touch_is_right(readers[one].state) for one in Transport},
            corrupted_refused=bluetooth.state.R2_value == 0,
            foreign_flags=any(_foreign(report) for report in at_rest),
            released_at_close=_ends_released(left, effect_places=(11, 22)),
            debug_codes=any(int(mode) in DEBUG_CODES for mode in self._modes().__members__.values()),
            after_unplug="says nothing, and reads no more" if not ended.connected else "goes on",
        )

    def _run(self, reports: Sequence[bytes]) -> tuple[Any, list[bytes]]:
        """Let it read these until it finds itself unplugged; it, and what it wrote."""
        player = self._player_of(reports)
        driver = self._module()
        driver.init()
        driver.report_thread.join()
        return driver, player.written

    def _left_at_close(self) -> tuple[Any, bytes]:
        """It unplugged, and the last report of another one that was closed with an effect on."""
        unplugged, _ = self._run([build_input_report(PULLED)] * 3)
        player = self._player_of([build_input_report(PULLED)], endless=True)
        driver = self._module()
        driver.init()
        try:
            for trigger in (driver.triggerL, driver.triggerR):
                trigger.setMode(self._modes().Rigid)
                trigger.setForce(1, 255)
        finally:
            driver.close()
        return unplugged, player.written[-1]

    def _player_of(self, reports: Sequence[bytes], *, endless: bool = False) -> Player:
        player = Player(reports, endless=endless)
        binding = ctypes_binding(player)
        module: Any = sys.modules[self._module.__module__]
        module.hidapi.Device, module.hidapi.enumerate = binding.Device, binding.enumerate
        return player

    def _modes(self) -> Any:
        return sys.modules[self._module.__module__].TriggerModes


class _Plugged:
    """A search that finds the player while it is plugged in, at once."""

    def __init__(self) -> None:
        self.plugged = True
        self._begun = False

    def begin(self, preferred: str | None) -> None:
        del preferred
        self._begun = True

    def take(self) -> OpenController | NoDeviceError | None:
        if not self._begun:
            return None
        self._begun = False
        if not self.plugged:
            return NoDeviceError("no DualSense")
        # Its reports end when it is unplugged, a second later.
        player = Player([build_input_report(PULLED)] * (_READS_PER_S + 1))
        return OpenController(HidDualSense(CythonBackend(player), b"/dev/hidraw-player"), "player")

    def close(self) -> None:
        pass


class _Nobody:
    """A listener that does not care."""

    def controller_found(self, now_s: float) -> None:
        del now_s

    def controller_lost(self, now_s: float) -> None:
        del now_s


def best_time_s(read: Callable[[bytes], object], reports: Sequence[bytes], rounds: int) -> float:
    """Of one report, on average over these, in the best of so many rounds."""

    def all_of_them() -> None:
        for report in reports:
            read(report)

    return min(timeit.repeat(all_of_them, number=10, repeat=rounds)) / (10 * len(reports))


def corrupted() -> bytes:
    """A Bluetooth report with R2 pulled by a bit error that its checksum gives away."""
    report = bytearray(build_input_report(ControllerState(), Transport.BLUETOOTH))
    report[7] ^= 0x80
    return bytes(report)


def _varied(transport: Transport) -> list[bytes]:
    """Reports of which no two are alike, as a hand on the controller makes them."""
    states = (
        ControllerState(
            r2=number / _PLAYED_REPORTS,
            left_stick=(number / _PLAYED_REPORTS - 0.5, 0.25),
            sequence=number,
            gyro_rad_s=(0.01 * number, -0.02 * number, 0.03),
            acceleration_m_s2=(0.1 * number, 9.8, 0.2),
        )
        for number in range(_PLAYED_REPORTS)
    )
    return [build_input_report(state, transport) for state in states]


def _refused(report: bytes) -> bool:
    with contextlib.suppress(RemoteProtocolError):
        parse_input_report(report)
        return False
    return True


def _encodes(code: int) -> bool:
    """Whether the bytes of an effect with this code can be made to leave."""
    report = bytearray(build_output_report(OutputReport(r2=Feedback(3, 6))))
    report[_FIRST_EFFECTS[Transport.USB][0]] = code
    player = Player([build_input_report(PULLED)], endless=True)
    device = HidDualSense(CythonBackend(player), b"/dev/hidraw-player")
    with contextlib.suppress(ValueError):
        device.write(bytes(report), 0.0)
    return bool(player.written)


def _foreign(report: bytes) -> bool:
    """Whether an output report has a flag that is not for triggers or rumble."""
    start = _FIRST_COMMON[report[0]]
    return any(report[start + place] & ~ours & 0xFF for place, ours in enumerate(_OUR_FLAGS))


def _ends_released(report: bytes, effect_places: tuple[int, int]) -> bool:
    return all(report[place] in (0x00, 0x05) for place in effect_places)


def _ours_is_right(state: ControllerState) -> bool:
    if state.gyro_rad_s is None or state.acceleration_m_s2 is None:
        return False
    counts = NOMINAL_MOTION.gyro_counts(state.gyro_rad_s), NOMINAL_MOTION.acceleration_counts(state.acceleration_m_s2)
    return counts == (_GYRO_COUNTS, _ACCELERATION_COUNTS)


def _theirs_is_right(state: Any) -> bool:
    gyro, acceleration = state.gyro, state.accelerometer
    return (
        (gyro.Pitch, gyro.Yaw, gyro.Roll),
        (acceleration.X, acceleration.Y, acceleration.Z),
    ) == (_GYRO_COUNTS, _ACCELERATION_COUNTS)


def _their_touch_is_right(state: Any) -> bool:
    point, told = (PULLED.touches or ())[0], state.trackPadTouch0
    return bool(told.isActive) and (point.identity, point.x, point.y) == (told.ID, told.X, told.Y)
