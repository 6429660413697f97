"""Debian packages unpacked into a folder; nothing is installed on the system."""

import fcntl
import os
import platform
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from tests.kernel.skipped import SkippedError

Parts = TypeVar("Parts")

_PATIENCE_S = 90.0


def default_cache(name: str) -> Path:
    """Where the packages of the test `name` are kept from one run to the next."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "feelahead" / name


def provide_from(cache: Path, names: Callable[[Path], list[str]], found: Callable[[Path], Parts]) -> Parts:
    """`found` in the folder of unpacked packages, which are downloaded when need be; SkippedError when that fails.

    `names` says which packages, once apt's lists are in `cache`; `found` raises FileNotFoundError for a missing part.
    """
    if platform.machine() != "x86_64":
        raise SkippedError(f"the machine is {platform.machine()}; the test boots an x86_64 kernel")
    for program in ("apt-get", "apt-cache", "dpkg-deb"):
        if shutil.which(program) is None:
            raise SkippedError(f"no {program}: the machine and its kernel come as Debian packages")
    cache.mkdir(parents=True, exist_ok=True)
    with (cache / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another run may be filling it
        return _provide(cache, names, found)


def _provide(cache: Path, names: Callable[[Path], list[str]], found: Callable[[Path], Parts]) -> Parts:
    root = cache / "root"
    if not (cache / "complete").exists():
        _download(cache, root, names)
        (cache / "complete").touch()
    try:
        return found(root)
    except FileNotFoundError:
        # The system's libraries have changed, or somebody took a part away: once more from the start.
        (cache / "complete").unlink()
        _download(cache, root, names)
        parts = found(root)
        (cache / "complete").touch()
        return parts


def library_path(root: Path) -> dict[str, str]:
    """What programs from unpacked packages need in their environment to find their libraries."""
    libraries = (root / place / "x86_64-linux-gnu" for place in ("lib", "usr/lib"))
    folders = sorted({str(path.parent) for folder in libraries for path in folder.rglob("*.so*")})
    return {"LD_LIBRARY_PATH": ":".join(folders)}


def only(folder: Path, pattern: str) -> Path:
    """The one file in `folder` of that pattern; FileNotFoundError for none and for several."""
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise FileNotFoundError(f"{folder}/{pattern}: {len(found)} found")
    return found[0]


def _download(cache: Path, root: Path, names: Callable[[Path], list[str]]) -> None:
    """Fill `root` anew; SkippedError when a package is not known or cannot be downloaded."""
    archives = cache / "archives"
    for folder in (root, archives):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    for partial in ("lists/partial", "apt/archives/partial"):
        (cache / partial).mkdir(parents=True, exist_ok=True)
    # Our own lists of packages: the system's may be empty, as in a container, or stale, or not ours to renew.
    run_package_tool(cache, "apt-get", ["update", "-o", "APT::Update::Error-Mode=any"])
    wanted = names(cache)
    if not wanted:
        raise SkippedError("all packages are installed, and yet a part of them is missing")
    print(f"downloading {len(wanted)} packages into {cache}", flush=True)
    run_package_tool(cache, "apt-get", ["download", *wanted], archives)
    for archive in sorted(archives.glob("*.deb")):
        run_package_tool(cache, "dpkg-deb", ["-x", str(archive), str(root)])
    for spent in ("archives", "lists", "apt"):
        shutil.rmtree(cache / spent)


def missing_for(cache: Path, package: str) -> list[str]:
    """`package=version` of `package` and of everything that it needs and the system lacks."""
    said = run_package_tool(cache, "apt-get", ["--simulate", "--no-install-recommends", "install", package])
    words = [line.split() for line in said.splitlines() if line.startswith("Inst ")]
    # "Inst NAME (VERSION ...)", and "Inst NAME [OLD VERSION] (VERSION ...)" for what would be brought up to date.
    return [f"{line[1]}={next(word for word in line if word.startswith('('))[1:]}" for line in words]


def run_package_tool(cache: Path, program: str, arguments: Sequence[str], folder: Path | None = None) -> str:
    """What `program` says with the lists and archives in `cache`; SkippedError when it fails."""
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
