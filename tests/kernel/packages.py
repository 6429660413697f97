"""QEMU, a kernel and busybox as Debian packages, unpacked into a folder; nothing is installed on the system."""

import fcntl
import os
import platform
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.kernel.skipped import SkippedError

_QEMU: Final = "qemu-system-x86_64"
_QEMU_PACKAGE = "qemu-system-x86"
_KERNEL_PACKAGE = "linux-image-amd64"
_BUSYBOX_PACKAGE = "busybox-static"
_PATIENCE_S = 90.0


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


def default_cache() -> Path:
    """Where the packages are kept from one run to the next."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "feelahead" / "kernel-test"


def provide(cache: Path) -> Parts:
    """Find the parts in `cache`, or download and unpack them there; SkippedError when they cannot be had."""
    cache.mkdir(parents=True, exist_ok=True)
    with (cache / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another run may be filling it
        return _provide(cache)


def _provide(cache: Path) -> Parts:
    if platform.machine() != "x86_64":
        raise SkippedError(f"the machine is {platform.machine()}; the test boots an x86_64 kernel")
    for program in ("apt-get", "apt-cache", "dpkg-deb"):
        if shutil.which(program) is None:
            raise SkippedError(f"no {program}: QEMU and the kernel come as Debian packages")
    root = cache / "root"
    if not (cache / "complete").exists():
        _download(cache, root)
        (cache / "complete").touch()
    try:
        return _found(root)
    except FileNotFoundError:
        # The system's libraries have changed, or somebody took a part away: once more from the start.
        (cache / "complete").unlink()
        _download(cache, root)
        parts = _found(root)
        (cache / "complete").touch()
        return parts


def _found(root: Path) -> Parts:
    """The parts in `root`; FileNotFoundError when one is missing or QEMU does not start."""
    kernel = _only(root / "boot", "vmlinuz-*")
    modules = _only(root / "lib/modules", "*") if (root / "lib/modules").exists() else _only(root, "usr/lib/modules/*")
    busybox = next((path for path in (root / "bin/busybox", root / "usr/bin/busybox") if path.exists()), None)
    if busybox is None:
        raise FileNotFoundError("busybox")
    installed = shutil.which(_QEMU)
    if installed is not None:
        return Parts(Path(installed), {}, None, kernel, modules, busybox)
    libraries = (root / place / "x86_64-linux-gnu" for place in ("lib", "usr/lib"))
    folders = sorted({str(path.parent) for folder in libraries for path in folder.rglob("*.so*")})
    qemu, environment = root / "usr/bin" / _QEMU, {"LD_LIBRARY_PATH": ":".join(folders)}
    started = subprocess.run(
        [str(qemu), "--version"], capture_output=True, env=os.environ | environment, timeout=60, check=False
    )
    if started.returncode != 0:
        raise FileNotFoundError(f"{_QEMU}: {started.stderr.decode(errors='replace').strip()}")
    return Parts(qemu, environment, root / "usr/share", kernel, modules, busybox)


def _only(folder: Path, pattern: str) -> Path:
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise FileNotFoundError(f"{folder}/{pattern}: {len(found)} found")
    return found[0]


def _download(cache: Path, root: Path) -> None:
    """Fill `root` anew; SkippedError when a package is not known or cannot be downloaded."""
    archives = cache / "archives"
    for folder in (root, archives):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    for partial in ("lists/partial", "apt/archives/partial"):
        (cache / partial).mkdir(parents=True, exist_ok=True)
    # Our own lists of packages: the system's may be empty, as in a container, or stale, or not ours to renew.
    _run(cache, "apt-get", ["update", "-o", "APT::Update::Error-Mode=any"])
    names = [_kernel_name(cache), _BUSYBOX_PACKAGE]
    if shutil.which(_QEMU) is None:
        names += _missing_for(cache, _QEMU_PACKAGE)
    print(f"downloading {len(names)} packages into {cache}", flush=True)
    _run(cache, "apt-get", ["download", *names], archives)
    for archive in sorted(archives.glob("*.deb")):
        _run(cache, "dpkg-deb", ["-x", str(archive), str(root)])
    for spent in ("archives", "lists", "apt"):
        shutil.rmtree(cache / spent)


def _kernel_name(cache: Path) -> str:
    """The package of the newest stock kernel, which the package of no version depends on."""
    for line in _run(cache, "apt-cache", ["depends", _KERNEL_PACKAGE]).splitlines():
        kind, _, name = line.strip().partition(": ")
        if kind == "Depends" and name.startswith("linux-image-"):
            return name
    raise SkippedError(f"{_KERNEL_PACKAGE} depends on no linux-image here: the kernel comes from Debian")


def _missing_for(cache: Path, package: str) -> list[str]:
    """`package=version` of `package` and of everything that it needs and the system lacks."""
    said = _run(cache, "apt-get", ["--simulate", "--no-install-recommends", "install", package])
    words = [line.split() for line in said.splitlines() if line.startswith("Inst ")]
    # "Inst NAME (VERSION ...)", and "Inst NAME [OLD VERSION] (VERSION ...)" for what would be brought up to date.
    return [f"{line[1]}={next(word for word in line if word.startswith('('))[1:]}" for line in words]


def _run(cache: Path, program: str, arguments: Sequence[str], folder: Path | None = None) -> str:
    options = {
        "Dir::State::lists": str(cache / "lists"),
        "Dir::Cache": str(cache / "apt"),
        "Debug::NoLocking": "true",
        "Acquire::Retries": "2",
        "Acquire::http::Timeout": "20",
        "Acquire::https::Timeout": "20",
    }
    if os.geteuid() == 0:
        options["APT::Sandbox::User"] = "root"  # another user may not write where we do
    settings = [part for name, value in options.items() for part in ("-o", f"{name}={value}")]
    command = [program, *(settings if program.startswith("apt") else ()), *arguments]
    try:
        done = subprocess.run(
            command,
            cwd=folder or cache,
            env=os.environ | {"LC_ALL": "C", "DEBIAN_FRONTEND": "noninteractive"},
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise SkippedError(f"{program} {arguments[0]} took more than {_PATIENCE_S:g} s") from None
    if done.returncode != 0:
        reasons = [line for line in done.stderr.splitlines() if line.startswith("E:")] or [f"code {done.returncode}"]
        raise SkippedError(f"{program} {arguments[0]}: {reasons[0].removeprefix('E: ')}")
    return done.stdout
