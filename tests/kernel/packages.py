"""QEMU, a kernel and busybox of Debian packages, unpacked into a folder; nothing is installed on the system."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from tests.helpers.machines.debian import Apt, library_path, only, unpacked

_QEMU: Final = "qemu-system-x86_64"
_KERNEL_PACKAGE: Final = "linux-image-amd64"


@dataclass(frozen=True, slots=True)
class Parts:
    """Parts of the virtual machine."""

    qemu: Path
    qemu_environment: dict[str, str]
    """Environment variables by which QEMU finds its libraries"""
    firmware: Path | None
    """Folder with QEMU's firmware; None if QEMU is installed on the system and finds the firmware itself"""
    kernel: Path
    modules: Path
    """Folder of this kernel's modules, under lib/modules"""
    busybox: Path


def provide() -> Parts:
    """Return the parts of the virtual machine, downloaded if needed; skip the test if they cannot be had."""
    return unpacked("kernel", _packages, _found)


def _found(root: Path) -> Parts:
    """Find the parts in `root`; FileNotFoundError if one is missing or QEMU does not start."""
    kernel = only(root / "boot", "vmlinuz-*")
    modules = only(root / "lib/modules", "*") if (root / "lib/modules").exists() else only(root, "usr/lib/modules/*")
    busybox = next((path for path in (root / "bin/busybox", root / "usr/bin/busybox") if path.exists()), None)
    if busybox is None:
        raise FileNotFoundError("busybox")
    if (installed := shutil.which(_QEMU)) is not None:
        return Parts(Path(installed), {}, None, kernel, modules, busybox)
    qemu, environment = root / "usr/bin" / _QEMU, library_path(root)
    started = subprocess.run([str(qemu), "--version"], capture_output=True, env=os.environ | environment, check=False)
    if started.returncode != 0:
        raise FileNotFoundError(f"{_QEMU}: {started.stderr.decode(errors='replace').strip()}")
    return Parts(qemu, environment, root / "usr/share", kernel, modules, busybox)


def _packages(apt: Apt) -> list[str]:
    depends = apt.run("apt-cache", "depends", _KERNEL_PACKAGE).split()
    # The package without a version depends on the newest stock kernel.
    kernels = [name for name in depends if name.startswith("linux-image-") and name != _KERNEL_PACKAGE]
    if not kernels:
        pytest.skip(f"{_KERNEL_PACKAGE} depends on no linux-image here: the kernel comes from Debian")
    qemu = [] if shutil.which(_QEMU) else apt.missing_for("qemu-system-x86")
    return [kernels[0], "busybox-static", *qemu]
