"""Controller that hidapi takes for a real one, for the commands that measure it or write to it."""

import contextlib
from collections.abc import Callable
from pathlib import Path

import pytest

from operator_side.controller.state import ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from tests.helpers.fake_hid import FakeBackend, FakeHandle

REPORT_S = 0.004


class Played:
    """Controller whose state follows a clock of its own, which is this object."""

    def __init__(self) -> None:
        self.handle, self.now_s = FakeHandle(), 0.0
        self.backend = FakeBackend({0x0CE6: {b"/dev/hidraw93": self.handle}})
        self.hands: Callable[[float], ControllerState | None] = lambda _: ControllerState()
        self.at_turn: Callable[[], None] = lambda: None

    def now(self) -> float:
        self.now_s += REPORT_S
        self.at_turn()
        state = self.hands(self.now_s)
        self.handle.waiting = [] if state is None else [build_input_report(state, sensor_time_s=self.now_s)]
        return self.now_s


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> Played:
    controller = Played()
    for module in ("feel.command", "calibrate"):
        monkeypatch.setattr(f"feelahead.commands.{module}.MonotonicClock", lambda: controller)
    for module in ("feel.loop", "calibrate"):
        monkeypatch.setattr(f"feelahead.commands.{module}.time.sleep", lambda _: None)
    monkeypatch.setattr("feelahead.commands.feel.command.ReleaseGuard", contextlib.nullcontext)
    return controller


@pytest.fixture
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path / "config"
