import pytest

from operator_side.hands.button_map import Action, button_of
from operator_side.main import command
from tests.helpers.repository import ROOT


def test_the_docs_say_what_the_code_does_and_no_button_has_two_actions() -> None:
    lines = (ROOT / "docs" / "controls.md").read_text(encoding="utf-8").splitlines()
    rows = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines if line.startswith("|")]
    plain, swapped = button_of(swap_sides=False), button_of(swap_sides=True)
    assert rows[6:] == [(action.value, plain[action].value, swapped[action].value) for action in Action]
    for column in (1, 2):
        assert len({row[column] for row in rows[2:]}) == len(rows[2:])


def test_the_help_shows_the_flags_and_is_no_error(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        command(["--help"])
    assert stop.value.code == 0
    assert "--swap-sides" in capsys.readouterr().out
