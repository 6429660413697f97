"""The console's address is always said, and opened only before somebody's eyes."""

import sys
import threading
import webbrowser

import pytest

from common.command.status import Status
from feelahead.commands import open_browser

ADDRESS = "http://127.0.0.1:1/token/"


@pytest.mark.parametrize(
    ("terminal", "display", "opens"), [(True, ":0", True), (True, "", False), (False, ":0", False)]
)
def test_it_opens_in_a_terminal_with_a_display_alone(
    terminal: bool, display: str, opens: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened, done = [], threading.Event()

    def open_it(address: str) -> None:
        opened.append(address)
        done.set()

    monkeypatch.setattr(webbrowser, "open", open_it)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    open_browser.show_address(ADDRESS, Status("none", "test"))
    if opens:
        done.wait(20.0)
    assert opened == [ADDRESS] * opens
