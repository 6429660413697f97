"""The terminal as a whole screen, and back: what is on it now is there again afterwards."""

import contextlib
import os
import termios
from typing import Any, Final, TextIO

from common.errors import ConfigurationError

_ENTER: Final = "\x1b[?1049h\x1b[?25l\x1b[?7l"
"""The other screen, without a cursor, and without going on in the next line."""
_LEAVE: Final = "\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l"
_INPUT: Final = 0
_LOCAL: Final = 3
_CONTROL_LETTERS: Final = 6
_NO_LETTER: Final = b"\x00"
Attributes = list[Any]


def required_terminal(stream: TextIO | None) -> int:
    """The descriptor of a stream that leads to a terminal; ConfigurationError where it cannot be drawn on."""
    if stream is None or not stream.isatty():
        raise ConfigurationError("--tui: standard output is no terminal; valid: a terminal, or no --tui")
    if os.environ.get("TERM", "dumb") == "dumb":
        raise ConfigurationError("--tui: TERM says that the terminal cannot be drawn on; valid: TERM=xterm, as a rule")
    return stream.fileno()


def attributes_of(descriptor: int) -> Attributes | None:
    """How the terminal treats what is typed, to be put back by `leave`; None where it does not say."""
    with contextlib.suppress(termios.error):
        return termios.tcgetattr(descriptor)
    return None


def enter(descriptor: int) -> None:
    """Take the other screen. What is typed is not shown, and only Ctrl-C does what it did.

    Ctrl-Z would leave an arm to itself, and Ctrl-S an old screen that looks like a new one.
    """
    if (attributes := attributes_of(descriptor)) is not None:
        letters = list(attributes[_CONTROL_LETTERS])
        letters[termios.VSUSP] = _NO_LETTER
        attributes[_CONTROL_LETTERS] = letters
        attributes[_INPUT] &= ~termios.IXON
        attributes[_LOCAL] &= ~termios.ECHO
        termios.tcsetattr(descriptor, termios.TCSANOW, attributes)
    os.write(descriptor, _ENTER.encode())


def leave(descriptor: int, attributes: Attributes | None) -> None:
    """Bring the first screen back, with the cursor; what was typed meanwhile is dropped. A closed one is left alone."""
    with contextlib.suppress(termios.error, OSError):
        if attributes is not None:
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, attributes)
        os.write(descriptor, _LEAVE.encode())
