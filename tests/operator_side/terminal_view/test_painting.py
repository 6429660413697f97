import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from operator_side.terminal_view.lines import Look, line
from operator_side.terminal_view.painting import Painter

SEQUENCE = re.compile(r"\x1b\[([0-9;?]*)([A-Za-z])|([^\x1b])")
rows_of_text = st.lists(st.text("abc ", min_size=10, max_size=10), min_size=1, max_size=6)


class Glass:
    """As much of a terminal as the painter needs."""

    def __init__(self) -> None:
        self.rows: dict[int, dict[int, str]] = {}
        self._row = self._column = 1

    def show(self, sent: str) -> None:
        for numbers, command, letter in SEQUENCE.findall(sent):
            if command == "H":
                self._row, self._column = map(int, numbers.split(";"))
            elif command == "J":
                self.rows.clear()
            elif letter:
                self.rows.setdefault(self._row, {})[self._column] = letter
                self._column += 1
            else:
                assert command == "m"

    def text(self) -> list[str]:
        return ["".join(letters[column] for column in sorted(letters)) for _, letters in sorted(self.rows.items())]


@given(st.lists(rows_of_text, min_size=1, max_size=8))
def test_the_glass_shows_the_newest_screen_whatever_was_before(screens: list[list[str]]) -> None:
    painter, glass = Painter(io.StringIO()), Glass()
    for rows in screens:
        glass.show(painter.paint([line((text, Look.ALARM)) for text in rows], 10))
        assert glass.text() == rows


def test_only_what_has_changed_is_sent_and_all_of_it_now_and_then() -> None:
    painter = Painter(io.StringIO())
    lines = [line(f"row {number}") for number in range(20)]
    painter.paint(lines, 10)
    assert painter.paint(lines, 10) == ""
    lines[3] = line("other")
    assert painter.paint(lines, 10).count("\x1b[4;1H") == painter.paint(lines, 10).count("H") + 1
    sent = [painter.paint(lines, 10) for _ in range(100)]
    assert [text.count("H") for text in sent if text] == [20, 20]


@pytest.mark.parametrize(("term", "no_color"), [("xterm-256color", False), ("xterm", True), ("vt220", False)])
def test_an_alarm_is_red_unless_no_colour_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, term: str, no_color: bool
) -> None:
    monkeypatch.setenv("TERM", term)
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.delenv("COLORTERM", raising=False)
    monkeypatch.delenv("NO_COLOR", raising=False)
    if no_color:
        monkeypatch.setenv("NO_COLOR", "1")
    sent = Painter(io.StringIO()).paint([line(("STOPPED", Look.ALARM))], 10)
    assert "STOPPED" in sent
    codes = {code for numbers, command, _ in SEQUENCE.findall(sent) if command == "m" for code in numbers.split(";")}
    assert ("41" in codes) != no_color
    assert "1" in codes  # it is bold all the same
