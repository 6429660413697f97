"""Button map: docs and help texts agree with it."""

import re

import pytest

from operator_side.hands.button_map import BUTTON_OF, Action, button_of
from operator_side.main import command
from operator_side.settings import OperatorSettings
from tests.helpers.repository import ROOT


def test_the_docs_say_what_the_code_does_and_no_button_has_two_actions() -> None:
    lines = (ROOT / "docs" / "controls.md").read_text(encoding="utf-8").splitlines()
    rows = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines if line.startswith("|")]
    plain, swapped = button_of(swap_sides=False), button_of(swap_sides=True)
    assert rows[6:] == [(action.value, plain[action].value, swapped[action].value) for action in Action]
    for column in (1, 2):
        assert len({row[column] for row in rows[2:]}) == len(rows[2:])


def test_the_help_says_what_the_code_does(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command(["--help"])
    shown = capsys.readouterr().out
    assert "--swap-sides" in shown
    said = " ".join((OperatorSettings.__doc__ or "").split()).lower()
    assert said.split(". ")[0].rstrip(".") in " ".join(re.sub("[│╭╮╰╯─|]", " ", shown).split()).lower()
    for words in (
        "the arm moves only while l1 is held",
        "options arms it",
        "circle stops everything",
        "cross closes the gripper",
        "square opens it",
        "triangle changes the target",
        "create hands the robot over",
        "up starts one, right is success, left failure, down discards it",
        "l3 changes the speed scale",
        "the touchpad the frame of the sticks",
        "mute, held, moves the arm back to its start",
        "r3 puts a simulated scene back, disarmed",
        "r2 advances",
        "l2 retreats",
        "the left stick moves across",
        "the right stick turns",
    ):
        assert words in said
    assert {button.value.lower() for button in BUTTON_OF.values()} <= set(re.findall(r"\w+", said))
