"""Bars, columns and curves out of letters: of blocks, or of ASCII where the terminal knows no others."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

EIGHTHS = 8


@dataclass(frozen=True)
class Signs:
    """The letters that pictures are made of."""

    steps: str
    """A column from nothing to full: nine letters."""
    bar: str
    rest: str
    """What of a bar is not reached."""
    finger: str
    rule: str
    unknown: str
    cut: str
    """At the end of what is cut."""
    plain: bool
    """Whether everything else has to be ASCII, too."""

    def words(self, text: str) -> str:
        """`text` in letters that the terminal knows."""
        return text.encode("ascii", "replace").decode("ascii") if self.plain else text

    def filled(self, share: float | None, cells: int) -> tuple[str, str]:
        """A bar of `cells`: what is reached, with its end, and the rest."""
        if share is None:
            return "", self.unknown * cells
        reached = math.ceil(min(1.0, max(0.0, share)) * cells)
        end = self.finger if reached else ""
        return self.bar * (reached - len(end)) + end, self.rest * (cells - reached)

    def columns(self, values: Iterable[float | None], height: int) -> list[str]:
        """Columns from 0 to 1, one letter wide and `height` high; the uppermost row first."""
        tops = [None if value is None else round(min(1.0, max(0.0, value)) * EIGHTHS * height) for value in values]
        rows = []
        for row in range(height - 1, -1, -1):
            letters = [" " if top is None else self.steps[min(EIGHTHS, max(0, top - EIGHTHS * row))] for top in tops]
            rows.append("".join(letters))
        return rows


BLOCKS = Signs(steps=" ▁▂▃▄▅▆▇█", bar="━", rest="·", finger="┫", rule="─", unknown="–", cut="…", plain=False)
ASCII = Signs(steps=" .:-=+*%#", bar="=", rest=".", finger="|", rule="-", unknown="-", cut="~", plain=True)


def signs_for(encoding: str, locale: Sequence[str | None]) -> Signs:
    """What a terminal can show. `encoding`: of our output; `locale`: LC_ALL, LC_CTYPE and LANG, None where not set."""
    everything, letters, language = locale
    # Python itself sets LC_CTYPE where nobody chose a locale, which says nothing about the terminal.
    chosen = everything or (letters if language or letters != "C.UTF-8" else None) or language or ""
    spoken = "utf" in chosen.lower() and encoding.lower().replace("-", "").startswith("utf8")
    return BLOCKS if spoken else ASCII
