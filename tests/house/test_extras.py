"""Each side installs and runs with its own extra alone, in an environment of its own."""

import os
import shutil
from pathlib import Path

import pytest

from tests.helpers.installing import absent, installed, run
from tests.helpers.repository import ROOT

pytestmark = pytest.mark.install


def lend_machine_code(bin_folder: Path) -> None:
    """The kernels' machine code of this checkout: compiling the same sources anew would take two minutes."""
    [package] = bin_folder.parent.glob("lib/python*/site-packages/robot_side")
    for cache in (ROOT / "robot_side").rglob("__pycache__"):
        folder = package / cache.parent.relative_to(ROOT / "robot_side")
        for source in folder.glob("*.py"):
            # Numba takes machine code for a source by its size and time.
            times = (cache.parent / source.name).stat()
            os.utime(source, ns=(times.st_atime_ns, times.st_mtime_ns))
        for code in cache.glob("*.nb[ci]"):
            (folder / "__pycache__").mkdir(exist_ok=True)
            shutil.copy2(code, folder / "__pycache__")


def test_the_robot_side_alone(wheel: Path, constraints: Path, tmp_path: Path) -> None:
    bin_folder = installed("robot", wheel, constraints, tmp_path / "robot")
    absent(bin_folder, "hid", "hidraw", "viser")
    lend_machine_code(bin_folder)
    ended = run(bin_folder / "feelahead-robot", "--bind", "tcp://127.0.0.1:0", "--duration", "0.5", "--status", "none")
    assert (ended.returncode, ended.stderr) == (0, "")


def test_the_operator_side_alone(wheel: Path, constraints: Path, tmp_path: Path) -> None:
    bin_folder = installed("operator", wheel, constraints, tmp_path / "operator")
    absent(bin_folder, "mujoco", "numba", "simplejpeg")
    ended = run(
        bin_folder / "feelahead-operator",
        *("--connect", "tcp://127.0.0.1:9", "--device", "simulated", "--duration", "0.5", "--status", "none"),
    )
    assert (ended.returncode, ended.stderr) == (0, "")
