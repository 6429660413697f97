"""The unit files in docs/systemd: systemd accepts them, and our commands accept the command lines in them."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from common.sockets.authentication import make_key_pair
from common.sockets.keys import KeyFolder
from tests.helpers.repository import ROOT

pytestmark = pytest.mark.processes

UNITS = ROOT / "docs" / "systemd"
INSTALLED = "/opt/feelahead/bin/"
ANALYZE = shutil.which("systemd-analyze")
EXPOSURE = {"feelahead-robot": 2.0, "feelahead-operator": 7.0}
"""Highest allowed exposure of each unit, from 0 to 10, as systemd-analyze measures it"""

needs_systemd = pytest.mark.skipif(ANALYZE is None, reason="systemd-analyze is not installed here")


@pytest.fixture
def keys(tmp_path: Path) -> KeyFolder:
    """Folder with the keys of both sides, in which the robot side allows the operator side's key."""
    folder = KeyFolder(tmp_path / "keys")
    for side in ("robot", "operator"):
        folder.write_pair(side, *make_key_pair())
    folder.allow("anna", folder.public_path("operator").read_text().splitlines()[-1])
    return folder


def analyzed(name: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run systemd-analyze on a unit whose program is replaced by one that exists on this machine."""
    text = (UNITS / f"{name}.service").read_text().replace(f"{INSTALLED}{name}", sys.executable)
    unit = folder / f"{name}.service"
    unit.write_text(text)
    return subprocess.run(
        [str(ANALYZE), *["--user"] * (name == "feelahead-operator"), "--no-pager", *arguments, str(unit)],
        capture_output=True,
        text=True,
        timeout=60,
        env={"PATH": "/usr/bin:/bin", "HOME": str(folder), "XDG_RUNTIME_DIR": str(folder)},
        check=False,
    )


@needs_systemd
@pytest.mark.parametrize("name", EXPOSURE)
def test_systemd_finds_nothing_wrong_and_little_left_open(name: str, tmp_path: Path) -> None:
    verified = analyzed(name, tmp_path, "verify")
    assert (verified.returncode, verified.stderr) == (0, "")
    judged = analyzed(name, tmp_path, "security", "--offline=true")
    if "Unknown option" in judged.stderr or "unrecognized option" in judged.stderr:
        pytest.skip("this systemd-analyze judges no unit files")
    level = re.search(r"exposure level for .*: ([\d.]+)", judged.stdout)
    assert level is not None, judged.stderr
    assert float(level[1]) <= EXPOSURE[name]


@pytest.mark.parametrize("name", EXPOSURE)
def test_a_unit_has_limits_and_never_gives_up(name: str) -> None:
    text = (UNITS / f"{name}.service").read_text()
    assert "\nStartLimitIntervalSec=0\n" in text
    assert "\nRestart=on-failure\n" in text
    for limit in ("MemoryMax", "TasksMax", "LimitNOFILE"):
        assert re.search(rf"^{limit}=[1-9]\d*[MG]?$", text, re.MULTILINE), limit


def command_line(name: str, **replaced: str) -> list[str]:
    """Return the words of a unit's ExecStart, split as systemd does.

    Variables get the values of the unit's Environment, or of `replaced`.
    """
    text = (UNITS / f"{name}.service").read_text()
    variables = dict(
        pair.split("=", 1) for line in re.findall(r"^Environment=(.*)$", text, re.MULTILINE) for pair in line.split()
    )
    variables |= replaced
    [command] = re.findall(r"^ExecStart=(.*)$", text, re.MULTILINE)
    program, *words = command.split()
    assert program == INSTALLED + name
    line: list[str] = []
    for word in words:
        if word.startswith("$") and not word.startswith("${"):
            line += variables.get(word[1:], "").split()
        else:
            line.append(re.sub(r"\$\{(\w+)\}", lambda found: variables[found[1]], word))
    return line


@pytest.mark.parametrize(
    ("side", "given", "folder"),
    [
        ("robot", {"FEELAHEAD_BIND": "tcp://127.0.0.1:0", "FEELAHEAD_FLAGS": "--seed 3 --realtime"}, "/etc"),
        ("operator", {"FEELAHEAD_CONNECT": "tcp://127.0.0.1:9", "FEELAHEAD_FLAGS": "--device simulated"}, "%E"),
    ],
)
def test_a_side_takes_its_flags(keys: KeyFolder, side: str, given: dict[str, str], folder: str) -> None:
    words = command_line(f"feelahead-{side}", **given)
    line = [word.replace(f"{folder}/feelahead/keys", str(keys.path)) for word in words]
    assert line != words
    # If a flag is repeated, the last one counts.
    command = [sys.executable, "-P", "-m", f"{side}_side", *line, "--duration", "0.5", "--status", "none"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")


def test_what_a_unit_writes_to_is_what_it_may() -> None:
    """The robot side keeps compiled kernels and gripper covers in the only folder that its unit may write to."""
    text = (UNITS / "feelahead-robot.service").read_text()
    assert "CacheDirectory=feelahead\n" in text
    assert "NUMBA_CACHE_DIR=%C/feelahead/kernels XDG_CACHE_HOME=%C\n" in text  # covers: $XDG_CACHE_HOME/feelahead
    assert "\nMemoryDenyWriteExecute" not in text
