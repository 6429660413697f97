"""`feelahead keys` as a person uses it on two machines, which are two folders here."""

import re
from pathlib import Path

import pytest

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
    assert "is revoked" in said(capsys, "revoke", "anna", *robot)
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
