"""One table of what does what, and docs and help that say the same."""

import re

import pytest

from operator_side.dualsense.reports.controller_state import Button
from operator_side.hands.button_map import BUTTON_OF, Action, Control, Motion, button_of, control_table
from operator_side.main import command
from operator_side.settings import OperatorSettings
from tests.helpers.repository import ROOT


def test_the_button_map() -> None:
    assert dict(BUTTON_OF) == {
        Action.RUN: Button.L1,
        Action.ARM: Button.OPTIONS,
        Action.EMERGENCY_STOP: Button.CIRCLE,
        Action.CLOSE_GRIPPER: Button.CROSS,
        Action.OPEN_GRIPPER: Button.SQUARE,
        Action.NEXT_TARGET: Button.TRIANGLE,
        Action.HAND_OVER: Button.CREATE,
    }


def test_every_action_has_one_button_and_no_button_two() -> None:
    for swap_sides in (False, True):
        buttons = button_of(swap_sides=swap_sides)
        assert set(buttons) == set(Action)
        assert len(set(buttons.values())) == len(Action)


def test_swapping_sides_changes_hold_to_run_alone() -> None:
    changed = {action for action in Action if button_of(swap_sides=True)[action] is not BUTTON_OF[action]}
    assert changed == {Action.RUN}
    assert button_of(swap_sides=True)[Action.RUN] is Button.R1


def test_the_table_has_everything() -> None:
    table = control_table()
    assert len(table) == len(Motion) + len(Action)
    for column in (1, 2):
        assert {row[column] for row in table} >= {control.value for control in Control}
        assert len({row[column] for row in table}) == len(table)


def test_the_docs_say_what_the_code_does() -> None:
    lines = (ROOT / "docs" / "controls.md").read_text(encoding="utf-8").splitlines()
    rows = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines if line.startswith("|")]
    assert rows[2:] == control_table()


def test_the_help_says_what_the_code_does(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command(["--help"])
    shown = capsys.readouterr().out
    assert "--swap-sides" in shown
    said = " ".join((OperatorSettings.__doc__ or "").split()).lower()
    assert said.split(". ")[0].rstrip(".") in " ".join(re.sub("[│╭╮╰╯─|]", " ", shown).split()).lower()
    for words in (
        "l1 held: the arm may move",
        "options: arm it",
        "circle stops everything",
        "cross closes",
        "square opens the gripper",
        "triangle changes the target",
        "create hands the robot over",
        "r2 advances",
        "l2 retreats",
        "the left stick moves across",
        "the right one turns",
    ):
        assert words in said
    assert {button.value.lower() for button in BUTTON_OF.values()} <= set(re.findall(r"\w+", said))
