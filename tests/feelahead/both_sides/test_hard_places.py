"""The two sides where something around them fails: they end in order, and say in one line what it was."""

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import pytest

import operator_side.main
import robot_side.main

LIMIT_S = 600.0
NOWHERE = ("--connect=tcp://127.0.0.1:9", "--device=simulated")
ROBOT = ("--bind=tcp://127.0.0.1:0",)
# Nothing that this process writes gets longer than that, as on a full disk.
FULL = """
import os, resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
os.execv(sys.argv[1], sys.argv[1:])
"""


@pytest.mark.processes
def test_a_summary_on_a_full_disk_is_one_line_and_the_old_one_stays(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    arguments = [*NOWHERE, "--duration=0.2", f"--summary={path}", "--status=none"]
    done = subprocess.run(
        [sys.executable, "-c", FULL, sys.executable, "-P", "-m", "operator_side", *arguments],
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.returncode == 2
    [line] = done.stderr.splitlines()
    assert line.startswith(f"feelahead-operator: --summary {path}: cannot be written: File too large; valid: ")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("side", "arguments"), [(operator_side.main, NOWHERE), (robot_side.main, ROBOT)], ids=["operator", "robot"]
)
def test_a_run_that_fails_in_whatever_way_has_its_summary(
    side: ModuleType, arguments: Sequence[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("of no kind that was thought of")

    command: Callable[[Sequence[str]], int] = side.command
    monkeypatch.setattr(side._Loop, "run", fail)
    path = tmp_path / "out.json"
    with pytest.raises(RuntimeError, match="of no kind"):
        command([*arguments, f"--summary={path}", "--status=none"])
    assert json.loads(path.read_text())["errors"] == ["of no kind that was thought of"]
