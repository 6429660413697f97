"""The commands in the documents exist and accept their arguments, and the examples run."""

import doctest
import re
import shlex
import textwrap
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest
import tyro

import feelahead.main
import operator_side.main
import robot_side.main
from common.command.command_line import load_toml
from feelahead.both_sides.history import History
from feelahead.commands import keys
from feelahead.commands.bench_and_try import bench, try_out
from feelahead.commands.demo.settings import DemoSettings
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings
from tests.helpers.repository import DATA, ROOT
from tests.two_hosts.guide import steps

README = "README.md"
TO_BE_TYPED = [README, "docs/two-machines.md", "docs/systemd/README.md"]
"""Documents in which each indented line is a command to be typed, except for files' content"""
DOCUMENTS = [
    README,
    "CONTRIBUTING.md",
    "SECURITY.md",
    *(str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs").rglob("*.md"))),
]
COMMANDS = {
    "feelahead": feelahead.main.command,
    "feelahead-robot": robot_side.main.command,
    "feelahead-operator": operator_side.main.command,
}
OTHERS = re.compile("cd|cp|echo|git|install|journalctl|mkdir|nft|python3|systemctl|systemd-sysusers|ufw")
NOT_TYPED = ("advancing  L2/R2 pull", "FEELAHEAD_")
"""Starts of indented lines that are no commands: a program prints them, or they are in a file"""
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
TAILS = {"allow": ["anna", KEY], "revoke": ["anna"], "make": ["robot"], "show": ["robot"]}
"""Arguments to add to an action of `feelahead keys` where a document names the action without them"""


class ParsedError(Exception):
    """Raised once a command's parser has accepted its arguments, so that the command does not run."""


@pytest.fixture
def parse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let each command end with ParsedError as soon as its parser has accepted its arguments."""
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
    """Return the commands in a document's indented blocks; blocks that show a file's content are left out."""
    blocks = [one for one in Document.read(ROOT / name).blocks() if not one.startswith(("from ", "import ", "<"))]
    lines = [line for block in blocks if not is_toml(block) for line in typed(block)]
    return [line for line in lines if not line.startswith(NOT_TYPED)]


def is_toml(block: str) -> bool:
    try:
        tomllib.loads(block)
    except tomllib.TOMLDecodeError:
        return False
    return True


def filled(command: str) -> list[str]:
    """Return a command's words, without sudo and with values for the placeholders in capitals."""
    for pattern, value in PLACEHOLDERS.items():
        command = re.sub(pattern, value, command)
    split = words(command)
    if split[-1:] == ["NAME"]:
        split[-1] = "--list"
    if split[:2] == ["feelahead", "keys"] and len(split) < 4:
        split += TAILS.get(split[2], []) if len(split) == 3 else ["list"]
    return split


def require_known(split: Sequence[str]) -> None:
    """Raise AssertionError or ConfigurationError if a command does not exist or would refuse its arguments."""
    if list(split[:2]) == ["make", "demo"]:
        split = ["feelahead", "demo", *words(" ".join(word.removeprefix("ARGS=") for word in split[2:]))]
    program, *arguments = split
    if program == "make":
        assert re.search(rf"^{arguments[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    elif program == "pytest":
        assert (ROOT / arguments[0]).exists(), arguments[0]
    elif program == "pip":
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
        named = re.findall(r"\[([a-z,]+)\]", arguments[-1])
        assert all(extra in extras for names in named for extra in names.split(","))
        locks = [word.removeprefix("../../") for word in arguments if word.endswith(".lock")]
        assert all((ROOT / lock).is_file() for lock in locks)
    elif program in COMMANDS:
        try:
            ended = COMMANDS[program](arguments)
        except ParsedError:
            return
        except SystemExit as shown:
            ended = int(shown.code or 0)
        assert ended == 0, split
    else:
        assert OTHERS.fullmatch(program), f"{program!r} is neither ours nor known; if people type it, add it to OTHERS"


@pytest.mark.parametrize("name", DOCUMENTS)
@pytest.mark.usefixtures("parse")
def test_every_command_is_known(name: str) -> None:
    for command in (*indented(name), *Document.read(ROOT / name).spans()):
        split = filled(command)
        if split and (name in TO_BE_TYPED or split[0] in {*COMMANDS, "make"}):
            require_known(split)


def test_every_command_benchmark_and_experiment_is_listed() -> None:
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    [section] = re.findall(r"## Every command\n(.*?)\n## ", text, re.DOTALL)
    named = {name.partition(" ")[0] for name in re.findall(r"`([a-z-]+(?: NAME)?)`", section)}
    assert named >= feelahead.main._COMMANDS.keys()
    for menu in (bench, try_out):
        [listed] = re.findall(rf"`{menu.name} NAME`\s+\(([^)]*)\)", section)
        assert set(listed.replace("\n", " ").split(", ")) == menu.questions.keys()


def test_the_settings_of_a_robot_are_settings(tmp_path: Path) -> None:
    blocks = [block for block in Document.read(ROOT / "docs" / "robots.md").blocks() if is_toml(block)]
    assert blocks
    for block in blocks:
        path = tmp_path / "settings.toml"
        path.write_text(block)
        key = next(iter(tomllib.loads(block)))
        kinds = [kind for kind in (RobotSettings, OperatorSettings, DemoSettings) if key in get_type_hints(kind)]
        load_toml(path, kinds[0])


def test_the_readme_fits_on_one_screen_and_has_the_first_episode_as_it_is() -> None:
    readme = Document.read(ROOT / README)
    assert len(readme.text.splitlines()) <= 100
    assert readme.fences("python") == [(ROOT / "examples" / "first_episode.py").read_text(encoding="utf-8")]


def test_the_citation_has_the_version_and_the_paper_of_the_readme() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"\nversion: {project['version']}\n" in citation
    [paper] = re.findall(r"^    title: (.*)$", citation, re.MULTILINE)
    assert paper in " ".join((ROOT / README).read_text(encoding="utf-8").split())


def test_the_code_in_the_python_guide_is_of_the_examples_or_runs() -> None:
    guide = Document.read(ROOT / "docs" / "python.md")
    examples = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "examples").glob("*.py"))]
    shape = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    given: dict[str, Any] = {"centers": np.zeros((2, 3)), "radii": np.ones(2), "vertices": np.stack([shape, shape])}
    others = [code for code in guide.fences("python") if not any(code in example for example in examples)]
    assert len(others) == 1
    exec(others[0], given)  # noqa: S102  # the guide's own lines
    assert given["volumes"].shape == given["areas"].shape == (2,)
    assert given["gradients"].shape == (2, 3)
    assert (given["volumes"] > 0.0).all()
    for session in guide.fences("pycon"):
        test = doctest.DocTestParser().get_doctest(session, {}, "docs/python.md", None, None)
        said: list[str] = []
        doctest.DocTestRunner().run(test, out=said.append)
        assert said == []
    named = re.findall(r"^\| `(\w+)` \| \(n", guide.text, re.MULTILINE)
    assert named == [field.name for field in fields(History)]


def test_the_guide_for_two_machines_is_in_order() -> None:
    """Only the order and the texts of the commands are checked here; `make test-two-hosts` runs them."""
    said = [(step.where, step.command.split(maxsplit=3)[:3]) for step in steps()]
    made = [(where, split[2]) for where, split in said if split[:2] == ["feelahead", "keys"]]
    assert made == [("robot", "make"), ("operator", "make"), ("robot", "allow")]
    assert [where for where, split in said if split[0] == f"feelahead-{where}"] == ["robot", "operator"]


_BLOCK = re.compile(r"(?:(?<=\n\n)|\A)((?:(?: {4}.*)?\n)+)")
_FENCE = re.compile(r"^```(\w*)\n(.*?)^```\n", re.DOTALL | re.MULTILINE)
_SPAN = re.compile(r"`((?:feelahead|feelahead-robot|feelahead-operator|make)(?:\s[^`]*)?)`")
_AN_OPTION = re.compile(r"\[--[^\]]*\]")


@dataclass(frozen=True)
class Document:
    text: str

    @classmethod
    def read(cls, path: Path) -> "Document":
        return cls(path.read_text(encoding="utf-8"))

    def fences(self, language: str) -> list[str]:
        return [code for kind, code in _FENCE.findall(self.text) if kind == language]

    def blocks(self) -> list[str]:
        text = _FENCE.sub("\n", self.text)
        return [block for found in _BLOCK.finditer(text) if (block := textwrap.dedent(found[1]).strip("\n"))]

    def spans(self) -> list[str]:
        return [" ".join(found[1].split()) for found in _SPAN.finditer(self.text)]


def typed(block: str) -> list[str]:
    """Return the commands of a block: its lines after `$ ` if there are any, otherwise all lines.

    Options in brackets are left out.
    """
    lines = [line for line in block.replace("\\\n", " ").splitlines() if line.strip()]
    if any(line.startswith("$ ") for line in lines):
        lines = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
    commands = [part for line in lines for part in _AN_OPTION.sub("", line).split(" && ")]
    return [command.partition(" | ")[0].strip() for command in commands]


def words(command: str) -> list[str]:
    """Split a command line as a shell does, without output redirection, sudo and folders."""
    split = shlex.split(command, comments=True)
    if ">" in split:
        split = split[: split.index(">")]
    if split[:2] == ["sudo", "-u"]:
        split = split[3:]
    elif split[:1] == ["sudo"]:
        split = split[1:]
    return [split[0].rpartition("/")[2], *split[1:]] if split else []
