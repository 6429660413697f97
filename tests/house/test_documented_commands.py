"""What the documents tell people to type exists, parses, and is run by a test or by CI."""

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest
import tyro

import feelahead.main
import operator_side.main
import robot_side.main
from common.command.command_line import load_toml
from common.errors import ConfigurationError
from feelahead.commands import keys
from feelahead.commands.bench_and_try import bench, try_out
from feelahead.commands.demo import DemoSettings
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings
from tests.helpers.documents import Document, typed, words
from tests.helpers.repository import DATA, ROOT

README = "README.md"
TO_BE_RUN = [name for name in (README, "docs/two-machines.md") if (ROOT / name).exists()]
INSTRUCTIONS = [*TO_BE_RUN, "docs/systemd/README.md"]
"""Each indented line of these is to be typed."""
DOCUMENTS = [
    README,
    "CONTRIBUTING.md",
    *(str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs").rglob("*.md"))),
]
COMMANDS = {
    "feelahead": feelahead.main.command,
    "feelahead-robot": robot_side.main.command,
    "feelahead-operator": operator_side.main.command,
}
OTHERS = {
    "cd",
    "cp",
    "echo",
    "git",
    "install",
    "journalctl",
    "mkdir",
    "nft",
    "python3",
    "systemctl",
    "systemd-sysusers",
}
OTHERS |= {"ufw"}
NOT_TYPED = ("advancing  L2/R2 pull", "FEELAHEAD_")
"""How lines begin that a program prints, or that stand in a file."""
KEY = "5a" * 32
PLACEHOLDERS = {
    r"\bROBOT-KEY\b|\bOPERATOR-KEY\b": KEY,
    r"tcp://(ROBOT|HOST)\b": "tcp://127.0.0.1",
    r"\bSPEC\b": "'delay 5ms'",
    r"\bmy_arm\.xml\b": str(DATA / "arm.xml"),
    r"--scene NAME\b": "--scene wall",
    r"\bNAME\.csv\.gz\b": "normal.csv.gz",
    r"--(config|peer-header) \S+": "",  # files that must be there
}

TWO_MACHINES = (".ci/run", "test-two-hosts\n")
RUN = {
    r"git clone|cd |make test$": (".ci/run", "make test\n"),
    r"make quick": (".ci/run", "make test\n"),  # the same commands, and more tests
    r"make test-kernel": (".ci/run", "test-kernel "),
    r"make test-containers": (".ci/run", "make test-containers"),
    r"make latency-experiment": ("tests/containers/checks.py", '"--compose"'),
    r"make soak": ("tests/feelahead/experiments/test_soak.py", '"--observers", "8"'),
    r"make test-two-hosts": TWO_MACHINES,
    r"make demo( --duration \S+)?$": ("tests/feelahead/both_sides/test_processes.py", "test_the_demo_runs_both_sides"),
    r"make demo --link .*--summary": (
        "tests/feelahead/both_sides/test_processes.py",
        '"--link", "delay 20ms", "--summary"',
    ),
    r"make demo --tui$": ("tests/feelahead/commands/test_demo_on_a_terminal.py", '"--tui"'),
    r"make test-console": (".ci/run", "make test-console"),
    r"make demo --scene": ("tests/feelahead/commands/test_demo.py", "test_the_robot_side_is_told_the_scene"),
    r"make demo --link .*--no-haptics": ("tests/feelahead/both_sides/test_loopback.py", "haptics=False"),
    r"feelahead demo --link .*--link-model": ("tests/common/emulation/test_trace.py", '"stream"'),
    r"pip install '?\.\[(robot|operator)\]": ("tests/house/test_extras.py", "_side_alone("),
    r"feelahead keys (make|allow|revoke)": (
        "tests/feelahead/commands/test_keys.py",
        "lead_from_nothing_to_an_allowed_operator",
    ),
    r"feelahead doctor --connect": ("tests/two_hosts/following.py", "_doctor_on_the_way"),
    r"feelahead doctor": ("tests/feelahead/commands/test_doctor.py", "command"),
    r"feelahead-robot( --bind \S+ --keys \S+)?$": (
        "tests/house/test_systemd_units.py",
        "the_robot_side_takes_its_flags",
    ),
    r"feelahead-operator( --connect \S+ --keys \S+ --robot-key \S+)?$": (
        "tests/house/test_systemd_units.py",
        "the_operator_side_takes_its_flags",
    ),
    r"feelahead-robot --model \S+ --site \S+$": ("tests/house/test_documented_commands.py", "test_an_arm_of_ones_own"),
    r"feelahead (replay|plot|export)": (
        "tests/feelahead/commands/test_recordings.py",
        "COMMANDS = (replay, export, plot)",
    ),
    r"feelahead --help": ("tests/house/test_base_install.py", '["feelahead", "--help"]'),
    r"(nft|ufw|iw) ": None,
}
"""By how a command begins: the file that runs it, and what stands there. None: nothing does, for it is not ours."""


class ParsedError(Exception):
    """The arguments are good: nothing more is to happen."""


@pytest.fixture
def parse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every command ends as soon as its own parser has taken its arguments."""
    cli, parse_args = tyro.cli, keys._Parser.parse_args

    def only_tyro(*arguments: Any, **options: Any) -> None:
        cli(*arguments, **options)
        raise ParsedError

    def only_argparse(*arguments: Any) -> None:
        parse_args(*arguments)
        raise ParsedError

    monkeypatch.setattr(tyro, "cli", only_tyro)
    monkeypatch.setattr(keys._Parser, "parse_args", only_argparse)
    monkeypatch.chdir(ROOT)


def indented(name: str) -> list[str]:
    """The commands of a document's indented blocks; of a block that is none, nothing."""
    names: dict[str, str] = {}
    return [
        line for block in Document.read(ROOT / name).blocks() if not is_content(block) for line in typed(block, names)
    ]


def is_content(block: str) -> bool:
    """Whether a block is a file's content: TOML, Python or XML."""
    return is_toml(block) or block.startswith(("from ", "import ", "<"))


def is_toml(block: str) -> bool:
    try:
        tomllib.loads(block)
    except tomllib.TOMLDecodeError:
        return False
    return True


def filled(command: str) -> list[str]:
    """A command's words, without sudo and with values for what stands in capitals."""
    for pattern, value in PLACEHOLDERS.items():
        command = re.sub(pattern, value, command)
    return words(command)


def unfolded(split: Sequence[str]) -> list[str]:
    """What `make demo ARGS="..."` runs."""
    if list(split[:2]) == ["make", "demo"]:
        given = [word.removeprefix("ARGS=") for word in split[2:]]
        return ["feelahead", "demo", *words(" ".join(given))]
    return list(split)


def require_known(split: list[str]) -> None:
    """AssertionError or ConfigurationError for a command that does not exist, or would not take its arguments."""
    program, *arguments = unfolded(split)
    if program == "make":
        targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
        assert arguments[0] in targets, f"make {arguments[0]}: the Makefile has {targets}"
    elif program == "pytest":
        assert (ROOT / arguments[0]).exists(), arguments[0]
    elif program == "pip":
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
        named = re.findall(r"\[([a-z,]+)\]", arguments[-1])
        assert all(extra in extras for names in named for extra in names.split(","))
    elif program in COMMANDS:
        try:
            ended = COMMANDS[program](arguments)
        except ParsedError:
            return
        except SystemExit as shown:
            ended = int(shown.code or 0)
        assert ended == 0, split
    else:
        assert program in OTHERS, f"{program!r} is neither ours nor known; if it is to be typed, add it to OTHERS"


@pytest.mark.parametrize("name", DOCUMENTS)
@pytest.mark.usefixtures("parse")
def test_every_command_is_known(name: str) -> None:
    for command in indented(name):
        split = filled(command)
        if split and not command.startswith(NOT_TYPED) and (name in INSTRUCTIONS or split[0] in {*COMMANDS, "make"}):
            require_known(split)


@pytest.mark.parametrize("name", DOCUMENTS)
@pytest.mark.usefixtures("parse")
def test_every_command_between_backticks_is_known(name: str) -> None:
    for command in Document.read(ROOT / name).spans():
        split = filled(command)
        if split[-1] == "NAME":
            split[-1] = "--list"
        if split[:2] == ["feelahead", "keys"] and len(split) < 4:
            # A name for one of the actions, and not all that it takes.
            tails: dict[str, list[str]] = {
                "allow": ["anna", KEY],
                "revoke": ["anna"],
                "make": ["robot"],
                "show": ["robot"],
            }
            split += tails.get(split[2], []) if len(split) == 3 else ["list"]
        require_known(split)


@pytest.mark.parametrize("name", TO_BE_RUN)
def test_every_command_is_run_by_something(name: str) -> None:
    """A new command needs a line in RUN."""
    for command in (*indented(name), *Document.read(ROOT / name).spans()):
        if command.startswith(NOT_TYPED):
            continue
        text = " ".join(words(command)).replace("ARGS=", "")
        runner = next((found for begins, found in RUN.items() if re.match(begins, text)), ("", ""))
        if runner is not None and text != "feelahead keys allow":
            file, telling = runner
            assert file, f"{name}: nothing is known to run {text!r}; add it to RUN"
            assert telling in (ROOT / file).read_text(), f"{file} no longer has {telling!r}"


def test_the_readme_lists_every_command_benchmark_and_experiment() -> None:
    [section] = re.findall(r"## Every command\n(.*?)\n## ", (ROOT / README).read_text(), re.DOTALL)
    for name in ("demo", "doctor", "calibrate", "keys", "virtual-dualsense", "bench NAME", "try NAME"):
        assert f"`{name}`" in section
    assert {
        name.partition(" ")[0] for name in re.findall(r"`([a-z-]+(?: NAME)?)`", section)
    } >= feelahead.main._COMMANDS.keys()
    for menu in (bench, try_out):
        [listed] = re.findall(rf"`{menu.name} NAME`\s+\(([^)]*)\)", section)
        assert set(listed.replace("\n", " ").split(", ")) == {*menu.questions, *menu.entries}


def test_the_settings_in_the_readme_are_settings(tmp_path: Path) -> None:
    blocks = [block for block in Document.read(ROOT / README).blocks() if is_toml(block)]
    assert blocks
    for block in blocks:
        path = tmp_path / "settings.toml"
        path.write_text(block)
        key = next(iter(tomllib.loads(block)))
        kinds = [kind for kind in (RobotSettings, OperatorSettings, DemoSettings) if key in get_type_hints(kind)]
        load_toml(path, kinds[0])


def test_the_python_in_the_readme_runs() -> None:
    blocks = [block for block in Document.read(ROOT / README).blocks() if block.startswith("from ")]
    assert blocks
    shape = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for block in blocks:
        given: dict[str, Any] = {
            "centers": np.zeros((2, 3)),
            "radii": np.ones(2),
            "vertices": np.stack([shape, 2.0 * shape]),
        }
        exec(block, given)  # noqa: S102  # the README's own lines
        assert given["volumes"].shape == given["areas"].shape == (2,)
        assert given["gradients"].shape == (2, 3)
        assert (given["volumes"] > 0.0).all()


@pytest.mark.processes
def test_an_arm_of_ones_own(tmp_path: Path) -> None:
    """As the README's command, on a port and for a time that do for a test."""
    [command] = [line for line in indented(README) if "my_arm.xml" in line]
    program, *arguments = filled(command.replace("pinch", "tool"))
    assert program == "feelahead-robot"
    short = ["--bind", "tcp://127.0.0.1:0", "--duration", "0.3", "--status", "none"]
    ended = subprocess.run(
        [sys.executable, "-P", "-m", "robot_side", *arguments, *short],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.usefixtures("parse")
@pytest.mark.parametrize(
    "command",
    ["feelahead bench overlapp", "feelahead-robot --probabilty 0.5", "make demmo", "make demo ARGS='--durration 3'"],
)
def test_a_misspelt_command_is_found(command: str) -> None:
    with pytest.raises((AssertionError, ConfigurationError)):
        require_known(filled(command))
