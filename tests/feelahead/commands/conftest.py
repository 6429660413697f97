"""Controller that hidapi takes for a real one, for the commands that measure it or write to it."""

import contextlib
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

import pytest

from operator_side.controller import search
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
    monkeypatch.setattr("feelahead.commands.controller.command.MonotonicClock", lambda: controller)
    monkeypatch.setattr(search.BackgroundSearch, "begin", _found_at_once)
    monkeypatch.setattr("feelahead.commands.controller.loop.time.sleep", lambda _: None)
    monkeypatch.setattr("feelahead.commands.controller.command.ReleaseGuard", contextlib.nullcontext)
    return controller


def _found_at_once(given: search.BackgroundSearch, preferred: str | None) -> None:
    """Search in this thread, as in another one the time of `Played` would go on meanwhile."""
    given._look = Future()
    search._find_for(given._find, preferred, given._look)


@pytest.fixture
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    return tmp_path / "config"
