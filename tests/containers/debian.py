"""Debian's packages, where the machine tests need some that are not there."""

import os
import shutil
import subprocess
from collections.abc import Callable, Mapping
from typing import Final

from tests.kernel.skipped import SkippedError

_INSTALL_S: Final = 600.0
Say = Callable[[str], None]


def install(packages: tuple[str, ...], program: str, say: Say) -> None:
    """Install `packages` unless `program` is there; SkippedError where that cannot be done."""
    if shutil.which(program) is not None:
        return
    if shutil.which("apt-get") is None:
        raise SkippedError(f"no {program} and no apt-get to install it")
    say(f"installing {', '.join(packages)}")
    run_or_skip(["apt-get", "update", "-qq"], {})
    run_or_skip(
        ["apt-get", "install", "-qq", "--no-install-recommends", "--yes", *packages],
        {"DEBIAN_FRONTEND": "noninteractive"},
    )


def run_or_skip(words: list[str], environment: Mapping[str, str]) -> None:
    """Run a command that provides something; SkippedError with its last word where it fails."""
    done = subprocess.run(
        words, env=os.environ | dict(environment), capture_output=True, text=True, timeout=_INSTALL_S, check=False
    )
    if done.returncode != 0:
        said = done.stderr.strip().splitlines()
        raise SkippedError(f"{words[0]}: {said[-1] if said else f'code {done.returncode}'}")
