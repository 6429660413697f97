"""The terminal taken over for a whole screen, and put back."""

import contextlib
import os
import termios
from typing import Any, Final

_LEAVE: Final = b"\x1b[0m\x1b[?25h\x1b[?1049l"
"""The first screen and its cursor."""
_INPUT, _LOCAL, _LETTERS = 0, 3, 6


def take_over(terminal: int) -> None:
    """Show nothing that is typed, and turn off two keys.

    Ctrl-Z would leave an arm to itself, and Ctrl-S an old screen that looks like a new one.
    """
    attributes = termios.tcgetattr(terminal)
    attributes[_LETTERS][termios.VSUSP] = b"\x00"
    attributes[_INPUT] &= ~termios.IXON
    attributes[_LOCAL] &= ~termios.ECHO
    termios.tcsetattr(terminal, termios.TCSANOW, attributes)


def put_back(terminal: int, attributes: list[Any]) -> None:
    """Bring the first screen back, with the cursor; what was typed meanwhile is dropped. A closed one is left alone."""
    with contextlib.suppress(termios.error, OSError):
        termios.tcsetattr(terminal, termios.TCSAFLUSH, attributes)
        os.write(terminal, _LEAVE)
