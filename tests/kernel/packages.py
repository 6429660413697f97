"""QEMU, a kernel and busybox as Debian packages, unpacked into a folder; nothing is installed on the system."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.kernel.debian import library_path, missing_for, only, provide_from, run_package_tool
from tests.kernel.skipped import SkippedError

_QEMU: Final = "qemu-system-x86_64"
_QEMU_PACKAGE = "qemu-system-x86"
_KERNEL_PACKAGE = "linux-image-amd64"
_BUSYBOX_PACKAGE = "busybox-static"


@dataclass(frozen=True, slots=True)
class Parts:
    """What the virtual machine is made of."""

    qemu: Path
    qemu_environment: dict[str, str]
    """What QEMU needs in its environment to find its libraries."""
    firmware: Path | None
    """The folder of QEMU's firmware; None where QEMU knows it by itself."""
    kernel: Path
    modules: Path
    """The kernel's own folder under lib/modules."""
    busybox: Path


def provide(cache: Path) -> Parts:
    """Find the parts in `cache`, or download and unpack them there; SkippedError when they cannot be had."""
    return provide_from(cache, _names, _found)


def _found(root: Path) -> Parts:
    """The parts in `root`; FileNotFoundError when one is missing or QEMU does not start."""
    kernel = only(root / "boot", "vmlinuz-*")
    modules = only(root / "lib/modules", "*") if (root / "lib/modules").exists() else only(root, "usr/lib/modules/*")
    busybox = next((path for path in (root / "bin/busybox", root / "usr/bin/busybox") if path.exists()), None)
    if busybox is None:
        raise FileNotFoundError("busybox")
    installed = shutil.which(_QEMU)
    if installed is not None:
        return Parts(Path(installed), {}, None, kernel, modules, busybox)
    qemu, environment = root / "usr/bin" / _QEMU, library_path(root)
    started = subprocess.run(
        [str(qemu), "--version"], capture_output=True, env=os.environ | environment, timeout=60, check=False
    )
    if started.returncode != 0:
        raise FileNotFoundError(f"{_QEMU}: {started.stderr.decode(errors='replace').strip()}")
    return Parts(qemu, environment, root / "usr/share", kernel, modules, busybox)


def _names(cache: Path) -> list[str]:
    names = [_kernel_name(cache), _BUSYBOX_PACKAGE]
    if shutil.which(_QEMU) is None:
        names += missing_for(cache, _QEMU_PACKAGE)
    return names


def _kernel_name(cache: Path) -> str:
    """The package of the newest stock kernel, which the package of no version depends on."""
    for line in run_package_tool(cache, "apt-cache", ["depends", _KERNEL_PACKAGE]).splitlines():
        kind, _, name = line.strip().partition(": ")
        if kind == "Depends" and name.startswith("linux-image-"):
            return name
    raise SkippedError(f"{_KERNEL_PACKAGE} depends on no linux-image here: the kernel comes from Debian")
