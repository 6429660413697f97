"""What a real controller needs: hidapi, permission, and to be there."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from feelahead.commands.doctor.finding import Finding, Verdict
from operator_side.dualsense.hid.udev import RULE_FILE, installing_command
from operator_side.dualsense.reports.models import PRODUCT_IDS, SONY_VENDOR_ID

_UHID: Final = "/dev/uhid"


@dataclass(frozen=True)
class HidFacts:
    """What is installed under the names that hidapi goes by."""

    version: str | None
    """Of the package hidapi; None where it is not installed."""
    packages_of_hid: tuple[str, ...]
    """All that install a module called `hid`."""
    trouble: str | None
    """Why it cannot be used; None if it can."""


@dataclass(frozen=True)
class ControllerSeen:
    """A controller that the system has, and what it says of itself; None for what it does not say."""

    model: str
    path: str
    transport: str | None = None
    address: str | None = None
    firmware: str | None = None
    battery: str | None = None
    trouble: str | None = None
    """Why it cannot be used, and what to do; None if it can."""


@dataclass(frozen=True)
class UhidFacts:
    """Whether virtual controllers can be made."""

    exists: bool
    writable: bool


def check_hidapi(platform: str, facts: HidFacts) -> Finding:
    """Whether hidapi is there, and no other package in its place."""
    name = "hidapi"
    if facts.version is None:
        return Finding(name, Verdict.NOTE, "not installed (for a real controller)", "pip install 'feelahead[operator]'")
    again = "pip install --force-reinstall hidapi"
    strangers = [package for package in facts.packages_of_hid if package.lower() != "hidapi"]
    if strangers:
        # On Linux ours is the module hidraw, which nobody else brings.
        verdict = Verdict.NOTE if platform == "linux" and facts.trouble is None else Verdict.MISSING
        said = f"{facts.version}, but the package {' and '.join(strangers)} installs a module called hid, too"
        return Finding(name, verdict, said, f"pip uninstall {' '.join(strangers)} && {again}")
    if facts.trouble is not None:
        return Finding(name, Verdict.MISSING, facts.trouble, again)
    return Finding(name, Verdict.OK, facts.version)


def check_permission(
    platform: str, *, is_root: bool, rules: Mapping[str, str], controllers: Sequence[ControllerSeen]
) -> Finding:
    """Whether a controller may be opened: seen to be so, or by udev's rules (`rules`: file -> text)."""
    name = "udev rule"
    if platform != "linux":
        return Finding(name, Verdict.OK, f"not needed on {platform}")
    if controllers and all(seen.trouble is None for seen in controllers):
        return Finding(name, Verdict.OK, "the controller can be opened")
    missing = missing_grants(rules)
    if not missing:
        return Finding(name, Verdict.OK, "there, for USB and Bluetooth")
    if is_root:
        return Finding(
            name,
            Verdict.OK,
            "not needed by root, who you are; what is below is for everybody else",
            installing_command(),
        )
    denied = any(seen.trouble is not None and "permission" in seen.trouble for seen in controllers)
    return Finding(
        name,
        Verdict.MISSING if denied else Verdict.NOTE,
        f"none in {RULE_FILE} or elsewhere lets you open {', '.join(missing)}; plug the controller in again after it",
        installing_command(),
    )


def missing_grants(rules: Mapping[str, str]) -> list[str]:
    """The models and transports that no rule in these files opens to the person at the machine."""
    lines = [line for text in rules.values() for line in text.splitlines() if not line.lstrip().startswith("#")]
    granting = [line for line in lines if "hidraw" in line and re.search(r'uaccess|MODE\s*:?=\s*"066', line)]
    missing = []
    for product, model in PRODUCT_IDS.items():
        for transport, pattern in (
            ("USB", rf'idProduct\}}\s*==\s*"{product:04x}"'),
            ("Bluetooth", rf'KERNELS\s*==\s*"[^"]*{SONY_VENDOR_ID:04X}:{product:04X}'),
        ):
            if not any(re.search(pattern, line, re.IGNORECASE) for line in granting):
                missing.append(f"a {model} on {transport}")
    return missing


def check_controllers(controllers: Sequence[ControllerSeen] | None) -> list[Finding]:
    """Each controller that is connected; None: without hidapi nobody can know."""
    if controllers is None:
        return [Finding("controller", Verdict.NOTE, "cannot be looked for without hidapi")]
    if not controllers:
        return [
            Finding(
                "controller",
                Verdict.NOTE,
                "none is connected (the demo simulates one)",
                "connect one by USB, or pair one by Bluetooth: hold Create and PS until its light flashes",
            )
        ]
    return [_described(seen) for seen in controllers]


def check_uhid(platform: str, facts: UhidFacts) -> Finding:
    """Whether `feelahead virtual-dualsense` can show a controller to the system."""
    name, purpose = _UHID, "for feelahead virtual-dualsense"
    if platform != "linux":
        return Finding(name, Verdict.NOTE, f"Linux alone has it ({purpose})")
    if not facts.exists:
        return Finding(name, Verdict.NOTE, f"not there ({purpose})", "sudo modprobe uhid")
    if not facts.writable:
        command = f"sudo setfacl -m u:{os.environ.get('USER', 'YOU')}:rw {_UHID}"
        return Finding(name, Verdict.NOTE, f"no permission ({purpose})", command)
    return Finding(name, Verdict.OK, f"can be used ({purpose})")


def _described(seen: ControllerSeen) -> Finding:
    place = f"{seen.model} at {seen.path}"
    if seen.trouble is not None:
        said, _, remedy = seen.trouble.partition(": ")
        return Finding("controller", Verdict.MISSING, f"{place}: {said}", remedy or None)
    parts = (seen.address, f"firmware {seen.firmware or 'unknown'}", f"battery {seen.battery or 'unknown'}")
    return Finding("controller", Verdict.OK, f"{place} on {seen.transport}: {', '.join(filter(None, parts))}")
