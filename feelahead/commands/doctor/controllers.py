"""Checks whether a real controller can be used: hidapi, permission to open it, its reports."""

import contextlib
import os
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from common.errors import DeviceError, NoDriverError, RemoteProtocolError
from feelahead.commands.doctor.finding import Finding, Verdict
from operator_side.dualsense.hid.device import HidBackend, HidDualSense, load_backend
from operator_side.dualsense.hid.finding import sightings
from operator_side.dualsense.hid.second_writer import PROC, REMEDY, writers_of
from operator_side.dualsense.hid.udev import RULE_FILE, RULE_FOLDERS, installing_command
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.models import PRODUCT_IDS, SONY_VENDOR_ID
from operator_side.evdev import pad as evdev

_NAME: Final = "controller"


def check_permission(*, is_root: bool, rules: Mapping[str, str], controllers: Sequence[Finding]) -> Finding:
    """Check whether a controller may be opened: by the findings of opened `controllers`, else by udev's rules.

    rules: text of each file of rules.
    """
    name = "udev rule"
    if sys.platform != "linux":
        return Finding(name, Verdict.OK, f"not needed on {sys.platform}")
    if all(seen.verdict is Verdict.OK for seen in controllers if seen.name == _NAME):
        return Finding(name, Verdict.OK, "the controller can be opened")
    if not (missing := missing_grants(rules)):
        return Finding(name, Verdict.OK, "installed, for USB and Bluetooth")
    remedy = installing_command()
    if is_root:
        return Finding(name, Verdict.OK, "not needed, as you are root; the command below is for other users", remedy)
    denied = any("no permission" in seen.said for seen in controllers)
    verdict = Verdict.MISSING if denied else Verdict.NOTE
    said = (
        f"no rule in {RULE_FILE} or elsewhere lets you open {', '.join(missing)}; "
        "after the command below, plug the controller in again"
    )
    return Finding(name, verdict, said, remedy)


def missing_grants(rules: Mapping[str, str]) -> list[str]:
    """Return the models and transports, as "a DualSense on USB", that no rule in these files lets a user open."""
    lines = [line for text in rules.values() for line in text.splitlines() if not line.lstrip().startswith("#")]
    granting = "\n".join(line for line in lines if "hidraw" in line and re.search(r'uaccess|MODE\s*:?=\s*"066', line))
    wanted = {
        f"a {model} on {transport}": pattern
        for product, model in PRODUCT_IDS.items()
        for transport, pattern in (
            ("USB", rf'idProduct\}}\s*==\s*"{product:04x}"'),
            ("Bluetooth", rf'KERNELS\s*==\s*"[^"]*{SONY_VENDOR_ID:04X}:{product:04X}'),
        )
    }
    return [what for what, pattern in wanted.items() if not re.search(pattern, granting, re.IGNORECASE)]


def controllers_seen() -> list[Finding]:
    """Open each connected controller for a moment; return a finding for each, or one that says why none is found."""
    try:
        backend = load_backend()
    except NoDriverError as error:
        return [Finding(_NAME, Verdict.NOTE, f"cannot be looked for: {error.said}", error.remedy)]
    how = "connect one by USB, or pair one by Bluetooth: hold Create and PS until its light flashes"
    none = Finding(_NAME, Verdict.NOTE, "none is connected (the demo simulates one)", how)
    found = sightings(backend)
    looks = [_look_at(backend, seen.path, seen.model) for seen in found] or [none]
    return looks + [_other_writer(name, seen.path) for seen in found for name in writers_of(seen.path, PROC)]


def gamepads_seen() -> list[Finding]:
    """Return a finding for each joystick, wheel and gamepad: its layout for --device evdev, or what it lacks."""
    findings = []
    for path, pad in evdev.controllers_seen()[0]:
        said = f"{pad.name} at {path}: {pad.layout or pad.lacks}"
        findings.append(Finding("gamepad", Verdict.OK if pad.is_pad else Verdict.NOTE, said))
        pad.close()
    return findings


def udev_rules() -> dict[str, str]:
    """Return the text of each readable file of udev's rules, by its path."""
    paths = [path for folder in RULE_FOLDERS for path in sorted(Path(folder).glob("*.rules"))]
    return {str(path): path.read_text(encoding="utf-8", errors="replace") for path in paths if os.access(path, os.R_OK)}


def _other_writer(name: str, path: bytes) -> Finding:
    said = f"{name} holds {os.fsdecode(path)} open for writing"
    return Finding("second writer", Verdict.NOTE, said, REMEDY)


def _look_at(backend: HidBackend, path: bytes, model: str) -> Finding:
    place = f"{model} at {os.fsdecode(path)}"
    try:
        device = HidDualSense(backend, path)
        device.check_presence()
    except DeviceError as error:
        return Finding(_NAME, Verdict.MISSING, f"{place}: {error.said}", error.remedy or None)
    identity, firmware, battery = device.identity, "unknown", "unknown"
    device.close()
    if (known := identity.firmware) is not None:
        firmware = f"0x{known.firmware_version:08x} (hardware 0x{known.hardware_version:08x})"
    with contextlib.suppress(RemoteProtocolError):
        state = parse_input_report(identity.first_report).battery
        battery = f"{'' if state.fraction is None else f'about {state.fraction:.0%}, '}{state.state.value}"
    parts = (identity.address, f"firmware {firmware}", f"battery {battery}")
    said = f"{place} on {identity.transport.value}: {', '.join(filter(None, parts))}"
    return Finding(_NAME, Verdict.OK, said)
