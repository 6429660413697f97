"""`feelahead keys` as a person uses it: two machines, here two folders."""

import re
from pathlib import Path

import pytest

import operator_side.main
import robot_side.main
from common.errors import ConfigurationError
from feelahead.main import command


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert command(["keys", *arguments]) == 0
    return capsys.readouterr().out


def test_the_printed_commands_lead_from_nothing_to_an_allowed_operator(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    robot, operator = (["--folder", str(tmp_path / side)] for side in ("robot", "operator"))
    assert "feelahead keys make robot" in said(capsys, "list", *robot)
    robot_key = re.findall(r"[0-9a-f]{64}", said(capsys, "make", "robot", *robot))[0]
    told = said(capsys, "make", "operator", *operator)
    [allow] = re.findall(r"feelahead keys (allow NAME [0-9a-f]{64})", told)
    assert said(capsys, "show", "robot", *robot).strip() == robot_key
    assert "anna" in said(capsys, *allow.replace("NAME", "anna").split(), *robot)
    listed = said(capsys, "list", *robot)
    assert robot_key in listed
    assert "anna" in listed
    assert "no more" in said(capsys, "revoke", "anna", *robot)
    assert "anna" not in said(capsys, "list", *robot)


def test_a_public_file_may_be_handed_over_and_a_file_named_as_no_peer_is_pointed_out(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = ["--folder", str(tmp_path / "robot")]
    said(capsys, "make", "operator", "--folder", str(tmp_path / "operator"))
    handed = tmp_path / "operator" / "operator.public"
    assert "anna" in said(capsys, "allow", "anna", str(handed), *folder)
    for name in ("alice.smith.public", ".hidden.public"):
        (tmp_path / "robot" / "allowed" / name).write_text(handed.read_text())
    listed = said(capsys, "list", *folder)
    assert "alice.smith.public: its name is no peer's; valid: letters" in listed
    assert "hidden" not in listed


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "ACTION"),
        (["mkae"], "mkae"),
        (["make", "camera"], "camera"),
        (["allow", "anna"], "KEY"),
        (["allow", "anna", "abc"], "'abc'"),
        (["allow", "../x", "ab" * 32], "'../x'"),
        (["revoke", "anna"], "'anna'"),
        (["show", "robot"], "feelahead keys make robot"),
    ],
)
def test_bad_input_is_one_line(tmp_path: Path, arguments: list[str], named: str) -> None:
    folder = ["--folder", str(tmp_path)] if arguments and arguments != ["mkae"] else []
    with pytest.raises(ConfigurationError) as caught:
        command(["keys", *arguments, *folder])
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("side", "arguments", "named"),
    [
        (robot_side.main, ["--keys", "missing"], "feelahead keys make robot --folder missing"),
        (robot_side.main, ["--keys", "missing", "--insecure"], "--insecure with --keys"),
        (robot_side.main, ["--bind", "tcp://0.0.0.0:5555"], "feelahead keys make robot"),
        (operator_side.main, ["--keys", "missing"], "feelahead keys make operator --folder missing"),
        (operator_side.main, ["--robot-key", "ab" * 32], "--keys"),
    ],
)
def test_each_side_says_what_to_run_next(side: object, arguments: list[str], named: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        side.command(arguments)  # type: ignore[attr-defined]
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)
