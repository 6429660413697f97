"""Display of the console's address, and of the page if possible."""

import os
import sys
import threading
import webbrowser

from common.command.status import Status


def show_address(address: str, status: Status) -> None:
    """Show the address on a line that stays; open the page if there are a display and a terminal."""
    if not status.event("console", address=address):
        status.note(f"the console: {address}")
    if sys.stdout.isatty() and has_display():
        # Some launchers wait for the browser to end.
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def has_display() -> bool:
    """Return whether there is a display: without one, a text browser would take over the terminal."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
