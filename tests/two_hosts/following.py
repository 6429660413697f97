"""Following the guide: each kind of command is run on its host, or checked otherwise where it would change ours."""

import re
import shlex
import shutil
import tomllib
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version

from operator_side.dualsense.hid.udev import RULE_FILE
from tests.helpers.repository import ROOT
from tests.kernel.waiting import require
from tests.two_hosts.guide import GuideError, Step, steps
from tests.two_hosts.lan import Host, Lan

PORTS = "5555", "5556"
_USUAL_FIREWALL = (
    "nft add table inet filter; nft add chain inet filter input '{ type filter hook input priority 0; policy drop; }'; "
    "nft add rule inet filter input ct state established,related accept"
)


def follow(lan: Lan) -> list[str]:
    """Do all that the guide says up to the starts, which are kept for `lan.start`; what was done instead of a line."""
    notes: list[str] = []
    hosts = {"robot": lan.robot_host, "operator": lan.operator_host}
    if shutil.which("nft") is not None:
        lan.robot_host.run(_USUAL_FIREWALL)
    for step in steps():
        done = _kind(step)(lan, hosts[step.where], step)
        if done is not None:
            notes.append(done)
    if lan.doctor is None:
        raise GuideError("no line looks at the way")
    for side in ("robot", "operator"):
        if side not in lan.starts:
            raise GuideError(f"no line starts the {side} side")
    return notes


def _kind(step: Step) -> Callable[[Lan, Host, Step], str | None]:
    found = [do for begins, do in _KINDS.items() if step.command.startswith(begins)]
    if not found:
        raise GuideError(f"{step.command}: nobody has said how to check this; valid: {', '.join(_KINDS)}")
    return found[0]


def _install(lan: Lan, host: Host, step: Step) -> str:
    """Instead: that side's extra, and no other, is named, and all of it is installed here."""
    del lan, host
    require(step.command == f'pip install ".[{step.where}]"', f"{step.command}: on the {step.where}'s machine")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for wanted in [*project["dependencies"], *project["optional-dependencies"][step.where]]:
        name = re.split(r"[^\w.-]", wanted, maxsplit=1)[0]
        try:
            version(name)
        except PackageNotFoundError:
            raise GuideError(f"{step.command}: {name} is not installed here") from None
    return f"{step.where}'s extra found installed"


def _keys(lan: Lan, host: Host, step: Step) -> None:
    said = host.run(step.filled_in(lan.words))
    if (made := re.match(r"feelahead keys make (robot|operator)$", step.command)) is not None:
        require(made[1] == step.where, f"{step.command}: on the {step.where}'s machine")
        key = re.search(r"\b[0-9a-f]{64}\b", said)
        require(key is not None, f"{step.command} prints no key: {said}")
        assert key is not None
        lan.words[f"{step.where.upper()}-KEY"] = key[0]


def _nft(lan: Lan, host: Host, step: Step) -> str | None:
    """As root already, on a host that lets nobody in otherwise."""
    del lan
    require(all(port in step.command for port in PORTS), f"{step.command}: not the ports {PORTS}")
    if shutil.which("nft") is None:
        return "nft: not here, hence no firewall"
    host.run(step.command.removeprefix("sudo "))
    return None


def _ufw(lan: Lan, host: Host, step: Step) -> str:
    """Instead: the ports are read; ufw is for the whole machine."""
    del lan, host
    require(step.command == f"sudo ufw allow {':'.join(PORTS)}/tcp", f"{step.command}: not the ports {PORTS}")
    return "ufw: ports read"


def _doctor(lan: Lan, host: Host, step: Step) -> str | None:
    del lan
    said = host.run(step.command, codes=(0, 1))
    require("--realtime" in said and "udev rule" in said, f"{step.command} says: {said}")
    return "doctor prints the udev rule" if RULE_FILE in said else None


def _doctor_on_the_way(lan: Lan, host: Host, step: Step) -> None:
    """Kept, too: there is nobody to reach yet."""
    require(host is lan.operator_host, f"{step.command}: on the {step.where}'s machine")
    lan.doctor = step.filled_in(lan.words)


def _start(lan: Lan, host: Host, step: Step) -> None:
    del host
    require(shlex.split(step.command)[0] == f"feelahead-{step.where}", f"{step.command}: on the {step.where}'s machine")
    lan.starts[step.where] = step.filled_in(lan.words)


_KINDS: dict[str, Callable[[Lan, Host, Step], str | None]] = {
    "pip install ": _install,
    "feelahead keys ": _keys,
    "sudo nft ": _nft,
    "sudo ufw ": _ufw,
    "feelahead doctor --connect ": _doctor_on_the_way,
    "feelahead doctor": _doctor,
    "feelahead-robot ": _start,
    "feelahead-operator ": _start,
}
