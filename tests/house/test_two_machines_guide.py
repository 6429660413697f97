"""docs/two-machines.md as far as it can be read without a network; `make test-two-hosts` follows it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.repository import ROOT
from tests.two_hosts.guide import GuideError, Step, commands_of, steps


def test_every_command_has_its_machine_and_its_order() -> None:
    said = [(step.where, step.command.split(maxsplit=3)[:3]) for step in steps()]
    keys = [(where, words[2]) for where, words in said if words[:2] == ["feelahead", "keys"]]
    assert keys == [("robot", "make"), ("operator", "make"), ("robot", "allow")]
    assert [where for where, words in said if words[0] == f"feelahead-{where}"] == ["robot", "operator"]


def test_the_readme_says_the_same_and_leads_there() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    section = readme.partition("## On two machines")[2].partition("\n## ")[0]
    commands = list(commands_of(section))
    assert len(commands) > 5
    assert set(commands) <= {step.command for step in steps()}
    assert "(docs/two-machines.md)" in section


def test_capitals_are_filled_in_and_unknown_ones_refused() -> None:
    step = Step("robot", "feelahead keys allow anna OPERATOR-KEY")
    assert step.filled_in({"OPERATOR-KEY": "00ff"}) == "feelahead keys allow anna 00ff"
    with pytest.raises(GuideError, match="nothing before it tells OPERATOR-KEY"):
        step.filled_in({"ROBOT": "robot.lan"})


def test_a_command_of_no_machine_is_refused(tmp_path: Path) -> None:
    guide = tmp_path / "guide.md"
    guide.write_text("# Guide\n\nOn the robot's machine:\n\n    one\n    two\n\n# Next\n\nDo:\n\n    three\n")
    with pytest.raises(GuideError, match=r"guide\.md: 'three': neither machine"):
        steps(guide)
    guide.write_text("On the robot's machine:\n\n    one\n\nOn the operator's:\n\n    two\n")
    assert steps(guide) == [Step("robot", "one"), Step("operator", "two")]


@pytest.mark.processes
def test_without_iproute2_it_is_skipped(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.two_hosts"],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env={**os.environ, "PATH": str(tmp_path), "PYTHONPATH": str(ROOT)},
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("skipped: network namespaces need root and iproute2")
