"""Show the console's address, and open its page in the browser if there is a display."""

import os
import sys
import threading
import webbrowser

from common.command.status import Status


def show_address(address: str, status: Status) -> None:
    """Show the address on its own line; on a terminal with a display, also open the page."""
    if not status.event("console", address=address):
        status.note(f"the console: {address}")
    if sys.stdout.isatty() and has_display():
        # In a thread, as some launchers return only when the browser ends.
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def has_display() -> bool:
    """Return whether a graphical display exists; without a display, a text browser would take over the terminal."""
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
