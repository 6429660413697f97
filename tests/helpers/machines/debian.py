"""Debian packages that test suites need: installed on the system in CI, or unpacked into a separate folder."""

import fcntl
import os
import platform
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final, TypeVar

import pytest

Parts = TypeVar("Parts")

_LIMIT_S: Final = 600.0
_LIBRARIES: Final = ("lib/x86_64-linux-gnu", "usr/lib/x86_64-linux-gnu")


def cache_folder(name: str) -> Path:
    """Return the folder in which the test suite `name` keeps files from one run to the next."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "feelahead" / f"{name}-test"
    cache.mkdir(parents=True, exist_ok=True)
    return cache


def install(packages: Sequence[str], program: str) -> None:
    """If `program` is missing, install `packages`; skip the test instead unless in CI, as root, on Debian."""
    if shutil.which(program) is not None:
        return
    if os.environ.get("CI") != "true" or os.geteuid() != 0 or shutil.which("apt-get") is None:
        pytest.skip(f"no {program} (run as root with CI=true, the tests install Debian's)")
    settings = {"DEBIAN_FRONTEND": "noninteractive"}
    with (cache_folder("apt") / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # apt does not wait for another suite's.
        run_or_skip(["apt-get", "update", "-qq"])
        run_or_skip(["apt-get", "install", "-qq", "--no-install-recommends", "--yes", *packages], settings)


def run_or_skip(words: Sequence[str], settings: Mapping[str, str] | None = None, folder: Path | None = None) -> str:
    """Run a command and return its output. If it fails, skip the test, with its last line of errors as the reason."""
    environment = os.environ | dict(settings or {})
    try:
        done = subprocess.run(
            words, env=environment, cwd=folder, capture_output=True, text=True, timeout=_LIMIT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        pytest.skip(str(error))
    if done.returncode != 0:
        pytest.skip(f"{words[0]}: {(done.stderr.strip().splitlines() or [f'code {done.returncode}'])[-1]}")
    return done.stdout


class Apt:
    """apt with package lists and archives in a separate folder.

    The system's own may be empty or stale, and are not changed.
    """

    def __init__(self, folder: Path) -> None:
        options = {
            "Dir::State::lists": str(folder / "lists"),
            "Dir::Cache": str(folder / "apt"),
            "Debug::NoLocking": "true",
            "Acquire::Retries": "2",
            "APT::Update::Error-Mode": "any",
        }
        if os.geteuid() == 0:
            options["APT::Sandbox::User"] = "root"  # apt's own user could not write to our folder.
        self._options = [part for name, value in options.items() for part in ("-o", f"{name}={value}")]
        for partial in ("lists/partial", "apt/archives/partial", "archives"):
            (folder / partial).mkdir(parents=True)
        self._archives = folder / "archives"

    def run(self, program: str, *words: str) -> str:
        """Run `apt-get` or `apt-cache`; skip the test if it fails."""
        return run_or_skip([program, *self._options, *words], {"LC_ALL": "C"}, self._archives)

    def missing_for(self, package: str) -> list[str]:
        """Return `package=version` of `package` and of all its dependencies that the system lacks."""
        said = self.run("apt-get", "--simulate", "--no-install-recommends", "install", package)
        words = [line.split() for line in said.splitlines() if line.startswith("Inst ")]
        # "Inst NAME (VERSION ...)", and "Inst NAME [OLD VERSION] (VERSION ...)" for upgrades.
        return [f"{line[1]}={next(word for word in line if word.startswith('('))[1:]}" for line in words]


def unpacked(name: str, packages: Callable[[Apt], list[str]], found: Callable[[Path], Parts]) -> Parts:
    """Return the result of `found` for the suite's folder of unpacked packages; if a part is missing, download them.

    `found` raises FileNotFoundError for a missing part. The test is skipped if no download is possible. Nothing is
    installed on the system.
    """
    if platform.machine() != "x86_64":
        pytest.skip(f"the machine is {platform.machine()}; the test boots an x86_64 kernel")
    for program in ("apt-get", "apt-cache", "dpkg-deb"):
        if shutil.which(program) is None:
            pytest.skip(f"no {program}: the machine and its kernel come as Debian packages")
    cache = cache_folder(name)
    with (cache / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # Another test run may be filling the folder.
        try:
            return found(cache / "root")
        except FileNotFoundError:
            # So it is the first time, and after changes of the system's libraries.
            _download(cache, packages)
            return found(cache / "root")


def _download(cache: Path, packages: Callable[[Apt], list[str]]) -> None:
    work = cache / "work"
    for folder in (work, cache / "root"):
        shutil.rmtree(folder, ignore_errors=True)
    apt = Apt(work)
    apt.run("apt-get", "update")
    apt.run("apt-get", "download", *packages(apt))
    for archive in sorted((work / "archives").glob("*.deb")):
        run_or_skip(["dpkg-deb", "-x", str(archive), str(work / "root")])
    (work / "root").rename(cache / "root")
    shutil.rmtree(work)


def library_path(root: Path) -> dict[str, str]:
    """Return the environment variable by which programs of unpacked packages find their libraries."""
    folders = {str(path.parent) for place in _LIBRARIES for path in (root / place).rglob("*.so*")}
    return {"LD_LIBRARY_PATH": ":".join(sorted(folders))}


def only(folder: Path, pattern: str) -> Path:
    """Return the only file in `folder` that matches `pattern`; FileNotFoundError if none or several match."""
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise FileNotFoundError(f"{folder}/{pattern}: {len(found)} found")
    return found[0]
