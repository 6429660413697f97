"""Environments for tests of installation. Their packages are links to those of this environment: nothing is fetched."""

import os
import subprocess
import sys
import venv
from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement


def run(*command: str | Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a command, with these environment variables, without those by which it would find the test run's packages."""
    environment = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    return subprocess.run(
        [str(part) for part in command],
        capture_output=True,
        text=True,
        timeout=1200,
        env=environment | variables,
        check=False,
    )


def installed(wheel: Path, folder: Path) -> Path:
    """Install the wheel alone in a new environment; return its Python."""
    venv.create(folder, symlinks=True)
    python = folder / "bin" / "python"
    command = (sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-index", "--no-deps", wheel)
    put = run(*command)
    assert put.returncode == 0, put.stderr
    return python


def link_packages(project: Distribution, extra: str, folder: Path) -> None:
    """Link all packages that a project needs with this extra, directly or not; AssertionError for a wrong version."""
    folder.mkdir()
    for package in {one.name: one for one in _needed(project, {extra})}.values():
        for name in {file.parts[0] for file in package.files or ()} - {"..", "__pycache__"}:
            (folder / name).symlink_to(Path(str(package.locate_file(name))))


def _needed(project: Distribution, extras: Iterable[str]) -> Iterator[Distribution]:
    for line in project.requires or ():
        requirement = Requirement(line)
        if requirement.marker is None or any(requirement.marker.evaluate({"extra": one}) for one in ("", *extras)):
            package = distribution(requirement.name)
            assert requirement.specifier.contains(package.version), f"{line}, but {package.version} is installed"
            yield package
            yield from _needed(package, requirement.extras)
