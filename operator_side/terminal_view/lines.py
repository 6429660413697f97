"""Lines of a screen: pieces of text with a style each, which colour only underlines what the words already say."""

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from rich.cells import cell_len, set_cell_size


class Look(Enum):
    """How a piece stands out, as Rich's words for it: no two differ in red and green alone."""

    PLAIN = ""
    FAINT = "bright_black"
    TITLE = "bold"
    GOOD = "bold black on bright_cyan"
    ALARM = "bold white on red"
    QUIET = "reverse"
    PULL = "bright_cyan"
    FELT = "bold bright_yellow"


class Piece(NamedTuple):
    """A few words in one style."""

    text: str
    look: Look = Look.PLAIN


Line = tuple[Piece, ...]


class Ranked(NamedTuple):
    """A line and what it is worth: 0 goes last where there is no room."""

    rank: int
    line: Line


def line(*pieces: str | tuple[str, Look]) -> Line:
    """Make a line; what cannot be printed, such as a terminal's control characters, becomes a question mark."""
    made = (Piece(piece) if isinstance(piece, str) else Piece(*piece) for piece in pieces)
    return tuple(Piece(_printable(text), look) for text, look in made)


def width_of(given: Line) -> int:
    """How many columns it takes."""
    return sum(cell_len(text) for text, _ in given)


def fitted(given: Line, width: int, cut: str = "") -> Line:
    """It in exactly `width` columns: filled up with blanks, or cut, with `cut` for what is left out."""
    missing = width - width_of(given)
    if missing >= 0:
        return (*given, Piece(" " * missing)) if missing else given
    room, kept = max(0, width - cell_len(cut)), []
    for text, look in given:
        part = text if cell_len(text) <= room else set_cell_size(text, room)
        room -= cell_len(part)
        kept.append(Piece(part, look))
    return (*kept, Piece(cut[:width]))


def beside(left: Sequence[Ranked], right: Sequence[Ranked], width: int, cut: str) -> list[Ranked]:
    """Two columns of as many lines each, with two blanks between them, `width` columns in all."""
    half = (width - 2) // 2
    return [
        Ranked(min(one.rank, other.rank), (*fitted(one.line, half, cut), Piece("  "), *fitted(other.line, half, cut)))
        for one, other in zip(left, right, strict=True)
    ]


def most_important(lines: Sequence[Ranked], height: int) -> list[Line]:
    """The `height` lines that are worth most, in their order; of equal ones the first."""
    order = sorted(range(len(lines)), key=lambda number: (lines[number].rank, number))
    return [lines[number].line for number in sorted(order[:height])]


def _printable(text: str) -> str:
    return text if text.isprintable() else "".join(sign if sign.isprintable() else "?" for sign in text)
