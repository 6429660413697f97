"""Hindrance: what keeps the arm from following the command, once a person would notice."""

from enum import IntEnum
from typing import Final

_BEGINS: Final = 0.25
_ENDS: Final = 0.15
"""Shares of the command left undone from which a hindrance begins, and below which it ends"""


class Cause(IntEnum):
    """Cause for which a part of a command is left undone."""

    END = 1
    """A joint is at the end of its range."""
    SINGULARITY = 2
    SPEED = 3
    """A joint is at its limit of speed."""
    JOINTS = 4
    """An arm with fewer than six joints cannot make every motion."""
    BOUNDS = 5
    """The tool is at a side of the workspace, or at its greatest speed."""


class Hindrance:
    """Present hindrance; it begins and ends with a hysteresis, so that it is told once."""

    def __init__(self) -> None:
        self.text: str | None = None
        """Hindrance in words; None if the arm follows the command"""
        self.undone = 0.0
        """Share of the commanded motion that the tool does not make, 0 to 1"""

    def end(self, still: str | None = None) -> None:
        """Note that nothing is commanded. still: what is to be told nevertheless."""
        self.text, self.undone = still, 0.0

    def refuse(self, why: str) -> None:
        """Note that a command is refused as a whole."""
        self.text, self.undone = why, 1.0

    def find(self, why: str) -> None:
        """Note that the arm was found not to follow, whatever was foreseen."""
        self.text = why

    def update(self, undone: float, cause: Cause | None, joint: int) -> None:
        """Take the figures of `Commanded`."""
        self.undone = undone
        if cause is None or undone < (_BEGINS if self.text is None else _ENDS):
            self.text = None
        else:
            self.text = _words(cause, joint)


def _words(cause: Cause, joint: int) -> str:
    match cause:
        case Cause.END:
            return f"joint {joint} at its limit"
        case Cause.SINGULARITY:
            return "near a singularity"
        case Cause.SPEED:
            return f"joint {joint} at its fastest"
        case Cause.JOINTS:
            return "too few joints for this motion"
        case Cause.BOUNDS:
            return "at a bound of the workspace, or of speed"
