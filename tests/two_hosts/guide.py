"""Run the guide docs/two-machines.md: its indented lines are commands, for the machine that the text before names."""

import re
import shlex
import shutil
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Final, Literal

from operator_side.dualsense.hid.udev import RULE_FILE
from tests.helpers.repository import ROOT
from tests.two_hosts.lan import Host, Lan

GUIDE: Final = ROOT / "docs" / "two-machines.md"
PORTS: Final = ("5555", "5556")
_PLACEHOLDER: Final = re.compile(r"\b(?:ROBOT|OPERATOR)(?:-KEY)?\b")
_USUAL_FIREWALL: Final = (
    "nft add table inet filter; nft add chain inet filter input '{ type filter hook input priority 0; policy drop; }'; "
    "nft add rule inet filter input ct state established,related accept"
)


@dataclass(frozen=True)
class Step:
    """One command of the guide, and the machine on which it is to be run."""

    where: Literal["robot", "operator"]
    command: str

    def filled_in(self, words: Mapping[str, str]) -> str:
        """Return the command with values for its placeholders; KeyError for one without a value so far."""
        return _PLACEHOLDER.sub(lambda match: words[match[0]], self.command)


def steps(path: Path = GUIDE) -> list[Step]:
    """Return the guide's commands in order; AssertionError if the text does not name the machine of a command."""
    found: list[Step] = []
    named: list[str] = []
    paragraph = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("    "):
            if paragraph:
                named, paragraph = re.findall(r"\bthe (robot|operator)'s", paragraph, flags=re.IGNORECASE), ""
            assert named, f"{path.name}: {line.strip()!r}: neither machine is named before it"
            found.append(Step("robot" if named[-1].lower() == "robot" else "operator", line.strip()))
        elif line.startswith("#"):
            named, paragraph = [], ""
        elif line.strip():
            paragraph += f" {line.strip()}"
        elif not paragraph.rstrip().endswith(":"):
            paragraph = ""
    return found


def follow(lan: Lan) -> None:
    """Run the guide's commands, except those that start a side: these are kept for `lan.start`."""
    hosts = {"robot": lan.robot_host, "operator": lan.operator_host}
    if shutil.which("nft") is not None:
        lan.robot_host.run(_USUAL_FIREWALL)
    for step in steps():
        _do(lan, hosts[step.where], step)
    assert lan.doctor, "the guide has no command that checks the path (feelahead doctor --connect)"
    assert lan.starts.keys() == hosts.keys()


def _do(lan: Lan, host: Host, step: Step) -> None:
    """Run a command on its host. A command that would change the real machine is only checked."""
    match shlex.split(step.command):
        case ["pip", "install", "--require-hashes", "-r", lock, "-r", "docker/build.lock"]:
            assert lock == f"docker/{step.where}.lock"
            locked = re.findall(r"^([\w.-]+)==", (ROOT / lock).read_text(encoding="utf-8"), re.MULTILINE)
            project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
            for package in [*project["dependencies"], *project["optional-dependencies"][step.where]]:
                name = re.split(r"[^\w.-]", package, maxsplit=1)[0]
                assert name in locked, f"{lock} has no {name}"
                version(name)
        case ["pip", "install", "--no-deps", "--no-build-isolation", "."]:
            pass
        case ["feelahead", "keys", "make", side]:
            assert side == step.where
            key = re.search(r"\b[0-9a-f]{64}\b", host.run(step.command))
            assert key is not None
            lan.words[f"{step.where.upper()}-KEY"] = key[0]
        case ["feelahead", "keys", *_]:
            host.run(step.filled_in(lan.words))
        case ["sudo", "nft", *_]:
            assert all(port in step.command for port in PORTS)
            if shutil.which("nft") is not None:
                host.run(step.command.removeprefix("sudo "))
        case ["sudo", "ufw", *_]:  # Would change the whole machine.
            assert step.command == f"sudo ufw allow {':'.join(PORTS)}/tcp"
        case ["feelahead", "doctor"]:
            said = host.run(step.command, codes=(0, 1))
            assert "--realtime" in said
            assert RULE_FILE in said or "udev rule" in said
        case ["feelahead", "doctor", "--connect", *_]:
            assert host is lan.operator_host
            lan.doctor = step.filled_in(lan.words)
        case [program, *_] if program == f"feelahead-{step.where}":
            lan.starts[step.where] = step.filled_in(lan.words)
        case _:
            raise AssertionError(f"{step.command}: unknown command; add here how to check it")
