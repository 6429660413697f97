"""Look at this machine: what the checks judge."""

import importlib.metadata
import json
import os
import socket
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from common.errors import DeviceError, NoDriverError, RemoteProtocolError
from feelahead.commands.doctor.controller_checks import ControllerSeen, HidFacts, UhidFacts
from feelahead.commands.doctor.kernel_checks import KernelFacts
from feelahead.commands.doctor.machine_checks import PORTS
from feelahead.commands.doctor.python_checks import EXTRAS, modules_of
from operator_side.dualsense.hid.device import HidBackend, HidDualSense, load_backend
from operator_side.dualsense.hid.finding import sightings
from operator_side.dualsense.hid.udev import RULE_FOLDERS
from operator_side.dualsense.reports.battery import Battery
from operator_side.dualsense.reports.feature_report import Firmware
from operator_side.dualsense.reports.input_report import parse_input_report

_IMPORT_LIMIT_S: Final = 60.0
_IMPORT: Final = """
import json, sys
failures = {}
for name in sys.argv[1:]:
    try:
        __import__(name)
    except Exception as error:
        failures[name] = str(error).splitlines()[0] if str(error) else type(error).__name__
print(json.dumps(failures))
"""
_RENDER: Final = """
import json, sys
from robot_side.cameras.off_screen import trouble_with
print(json.dumps(trouble_with(sys.argv[1])))
"""
_KERNELS: Final = """
import json
from robot_side.compiled.machine_code import can_keep, machine_code_folder
from robot_side.compiled.warm_up import import_kernels
kept = [kernel.is_kept for kernel in import_kernels()]
print(json.dumps([len(kept), kept.count(False), str(machine_code_folder()), can_keep()]))
"""
_REALTIME: Final = "import json; from common.realtime.priority import make_realtime; print(json.dumps(make_realtime()))"


def failed_imports() -> dict[str, dict[str, str]]:
    """For each extra the modules that cannot be imported, and why; each in a process of its own, which may crash."""
    with ThreadPoolExecutor(max_workers=2) as pool:
        outcomes = pool.map(lambda extra: _failures(modules_of(extra, sys.platform)), EXTRAS)
        return dict(zip(EXTRAS, outcomes, strict=True))


def hid_facts() -> HidFacts:
    """What is installed under hidapi's names."""
    try:
        version = importlib.metadata.version("hidapi")
    except importlib.metadata.PackageNotFoundError:
        version = None
    try:
        load_backend()
        trouble = None
    except NoDriverError as error:
        trouble = str(error)
    packages = importlib.metadata.packages_distributions().get("hid", [])
    return HidFacts(version, tuple(sorted(set(packages))), trouble)


def controllers_seen() -> list[ControllerSeen] | None:
    """Every controller that is connected, opened for a moment; None without hidapi."""
    try:
        backend = load_backend()
    except NoDriverError:
        return None
    return [_look_at(backend, seen.path, seen.model) for seen in sightings(backend)]


def udev_rules() -> dict[str, str]:
    """The text of each file of udev's rules."""
    texts = {}
    for folder in RULE_FOLDERS:
        for path in sorted(Path(folder).glob("*.rules")):
            try:
                texts[str(path)] = path.read_text(encoding="utf-8", errors="replace")
            except OSError:
                continue
    return texts


def uhid_facts() -> UhidFacts:
    """Whether there is /dev/uhid, and whether we may use it."""
    return UhidFacts(Path("/dev/uhid").exists(), os.access("/dev/uhid", os.R_OK | os.W_OK))


def realtime_notes() -> list[str]:
    """What `--realtime` would say, tried in a process of its own."""
    if sys.platform != "linux":
        return []
    notes: list[str] = json.loads(_output_of(_REALTIME) or "[]")
    return notes


def kernel_facts() -> KernelFacts | None:
    """Which kernels are compiled; None where none can be."""
    said = _output_of(_KERNELS)
    return None if said is None else KernelFacts(*json.loads(said))


def rendering_troubles(backends: Sequence[str]) -> dict[str, str | None]:
    """For each way to render without a screen why it does not work, None if it does; each in a process of its own."""
    outputs = {backend: _output_of(_RENDER, backend) for backend in backends}
    ended = "trying it ends Python, or takes too long"
    return {backend: ended if said is None else json.loads(said) for backend, said in outputs.items()}


def port_troubles() -> dict[int, str | None]:
    """For each default port why it cannot be bound on loopback; None if it can."""
    return {port: _trouble_at(port) for port in PORTS}


def is_root() -> bool:
    """Whether no permission is asked of us."""
    return hasattr(os, "geteuid") and os.geteuid() == 0


def _failures(modules: tuple[str, ...]) -> dict[str, str]:
    said = _output_of(_IMPORT, *modules)
    if said is None:  # which of them it was that took the process along is found one by one
        if len(modules) == 1:
            return {modules[0]: "importing it ends Python"}
        return {name: reason for module in modules for name, reason in _failures((module,)).items()}
    failures: dict[str, str] = json.loads(said)
    return failures


def _output_of(program: str, *arguments: str) -> str | None:
    """The last line that a Python process writes; None when it fails."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", program, *arguments],
            capture_output=True,
            text=True,
            check=True,
            timeout=_IMPORT_LIMIT_S,
            stdin=subprocess.DEVNULL,
        )
    except (subprocess.SubprocessError, OSError):
        return None
    return done.stdout.strip().splitlines()[-1]


def _look_at(backend: HidBackend, path: bytes, model: str) -> ControllerSeen:
    name = os.fsdecode(path)
    try:
        device = HidDualSense(backend, path)
    except DeviceError as error:
        return ControllerSeen(model, name, trouble=str(error))
    identity = device.identity
    device.close()
    try:
        battery = parse_input_report(identity.first_report).battery
    except RemoteProtocolError:
        battery = None
    return ControllerSeen(
        model,
        name,
        transport=identity.transport.value,
        address=identity.address,
        firmware=_firmware(identity.firmware),
        battery=_battery(battery),
    )


def _firmware(firmware: Firmware | None) -> str | None:
    if firmware is None:
        return None
    return f"0x{firmware.firmware_version:08x} (hardware 0x{firmware.hardware_version:08x})"


def _battery(battery: Battery | None) -> str | None:
    if battery is None:
        return None
    level = "" if battery.fraction is None else f"about {battery.fraction:.0%}, "
    return f"{level}{battery.state.value}"


def _trouble_at(port: int) -> str | None:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        # As the sides bind: what still lingers of an ended connection is no obstacle.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
            probe.listen(1)
        except OSError as error:
            return os.strerror(error.errno or 0)
    return None
