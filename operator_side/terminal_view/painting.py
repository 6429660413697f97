"""From the lines of a screen to what a terminal is sent: only the lines that have changed, in the colours it has."""

from collections.abc import Sequence
from typing import TextIO

from rich.color import ColorSystem
from rich.console import Console
from rich.style import Style

from operator_side.terminal_view.lines import Line, Look

_WHOLE_AGAIN = 50
"""Screens after which all is sent again: something else may have written over it."""


class Painter:
    """Remembers what the terminal shows."""

    def __init__(self, stream: TextIO) -> None:
        console = Console(file=stream, force_terminal=True)
        self._colors = None if console.color_system is None else ColorSystem.STANDARD
        styles = {look: Style.parse(look.value) for look in Look}
        self._styles = {look: style.without_color if console.no_color else style for look, style in styles.items()}
        self._shown: list[str] = []
        self._size = (0, 0)
        self._count = 0

    def paint(self, lines: Sequence[Line], width: int) -> str:
        """What makes a terminal that shows the screen before show `lines`."""
        painted = ["".join(self._piece(text, look) for text, look in line) for line in lines]
        begin = ""
        if self._size != (width, len(lines)):
            self._size, self._shown, begin = (width, len(lines)), [], "\x1b[0m\x1b[2J"
        elif self._count % _WHOLE_AGAIN == 0:
            self._shown = []
        self._count += 1
        before, self._shown = self._shown, painted
        changed = (
            f"\x1b[{row};1H{text}"
            for row, text in enumerate(painted, 1)
            if row > len(before) or before[row - 1] != text
        )
        return begin + "".join(changed)

    def _piece(self, text: str, look: Look) -> str:
        return self._styles[look].render(text, color_system=self._colors) if text else ""
