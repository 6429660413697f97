"""The console's address for a person, and its page before their eyes where that is possible."""

import os
import sys
import threading
import webbrowser

from common.command.status import Status


def show_address(address: str, status: Status) -> None:
    """Say it on a line that stays, and open it where there is a display and somebody at a terminal."""
    if not status.event("console", address=address):
        status.note(f"the console: {address}")
    if sys.stdout.isatty() and has_display():
        # Some ways to open a browser wait for it.
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def has_display() -> bool:
    """Whether a browser has somewhere to appear: without one, a text browser would take the terminal over."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
