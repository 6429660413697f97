"""Our own driver, put through what it is compared by."""

import contextlib
from typing import Final

from common.errors import NoDeviceError, RemoteProtocolError
from feelahead.benchmarks.dualsense.conduct import (
    ACCELERATION_COUNTS,
    GYRO_COUNTS,
    PULLED,
    REPORT_PERIOD_S,
    Conduct,
    best_time_s,
    corrupted_report,
    ends_released,
    sets_foreign_flags,
    varied_reports,
)
from feelahead.benchmarks.dualsense.player import CythonBackend, Player
from operator_side.core import OperatorSide
from operator_side.dualsense.effects.effect_codes import DEBUG_CODES
from operator_side.dualsense.effects.official import Feedback
from operator_side.dualsense.hid.connection import Connection, ConnectionState
from operator_side.dualsense.hid.device import HidDualSense
from operator_side.dualsense.hid.port import OpenController
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.input_report import build_input_report, parse_input_report
from operator_side.dualsense.reports.motion_sensors import NOMINAL_MOTION
from operator_side.dualsense.reports.output_report import OutputReport, build_output_report
from operator_side.dualsense.reports.transport import Transport

_R2_CODE: Final = 11
"""Of a USB output report: where the code of R2's effect stands."""
_PLUGGED_AGAIN_S: Final = 3.05
_READS_PER_S: Final = round(1.0 / REPORT_PERIOD_S)


class Ours:
    """feelahead's driver: operator_side/dualsense with the operator side's core."""

    name = "feelahead"

    def examine(self, rounds: int) -> Conduct:
        """As the protocol says."""
        reports = {transport: varied_reports(transport) for transport in Transport}
        states = {transport: parse_input_report(build_input_report(PULLED, transport)) for transport in Transport}
        effects_written = self._write_effect_and_close()
        return Conduct(
            parse_s={one: best_time_s(parse_input_report, reports[one], rounds) for one in Transport},
            writes_at_rest_per_s=self._writes_at_rest_per_s(),
            axes_right={one: _ours_is_right(states[one]) for one in Transport},
            touch_right={one: states[one].touches == PULLED.touches for one in Transport},
            corrupted_refused=_refused(corrupted_report()),
            foreign_flags=any(sets_foreign_flags(report) for report in effects_written),
            released_at_close=ends_released(effects_written[-1]),
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


def _refused(report: bytes) -> bool:
    with contextlib.suppress(RemoteProtocolError):
        parse_input_report(report)
        return False
    return True


def _encodes(code: int) -> bool:
    """Whether the bytes of an effect with this code can be made to leave."""
    report = bytearray(build_output_report(OutputReport(r2=Feedback(3, 6))))
    report[_R2_CODE] = code
    player = Player([build_input_report(PULLED)], endless=True)
    device = HidDualSense(CythonBackend(player), b"/dev/hidraw-player")
    with contextlib.suppress(ValueError):
        device.write(bytes(report), 0.0)
    return bool(player.written)


def _ours_is_right(state: ControllerState) -> bool:
    if state.gyro_rad_s is None or state.acceleration_m_s2 is None:
        return False
    counts = NOMINAL_MOTION.gyro_counts(state.gyro_rad_s), NOMINAL_MOTION.acceleration_counts(state.acceleration_m_s2)
    return counts == (GYRO_COUNTS, ACCELERATION_COUNTS)
