"""pydualsense, put through what our driver is compared by."""

import logging
import sys
from collections.abc import Sequence
from typing import Any

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
from feelahead.benchmarks.dualsense.player import Player, ctypes_binding
from operator_side.dualsense.effects.effect_codes import DEBUG_CODES
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from operator_side.dualsense.reports.transport import Transport


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
            parse_s[transport] = best_time_s(reader.readInput, varied_reports(transport), rounds)
            readers[transport], _ = self._run([build_input_report(PULLED, transport)] * 2)
        count = round(1.0 / REPORT_PERIOD_S)
        _, at_rest = self._run([build_input_report(PULLED)] * (count + 2))
        ended, left = self._left_at_close()
        bluetooth, _ = self._run(
            [build_input_report(ControllerState(), Transport.BLUETOOTH)] * 2 + [corrupted_report()]
        )
        return Conduct(
            parse_s=parse_s,
            writes_at_rest_per_s=len(at_rest) / (count * REPORT_PERIOD_S),
            axes_right={one: _theirs_is_right(readers[one].state) for one in Transport},
            touch_right={one: _their_touch_is_right(readers[one].state) for one in Transport},
            corrupted_refused=bluetooth.state.R2_value == 0,
            foreign_flags=any(sets_foreign_flags(report) for report in at_rest),
            released_at_close=ends_released(left),
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


def _theirs_is_right(state: Any) -> bool:
    gyro, acceleration = state.gyro, state.accelerometer
    return (
        (gyro.Pitch, gyro.Yaw, gyro.Roll),
        (acceleration.X, acceleration.Y, acceleration.Z),
    ) == (GYRO_COUNTS, ACCELERATION_COUNTS)


def _their_touch_is_right(state: Any) -> bool:
    point, told = (PULLED.touches or ())[0], state.trackPadTouch0
    return bool(told.isActive) and (point.identity, point.x, point.y) == (told.ID, told.X, told.Y)
