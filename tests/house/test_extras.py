"""Each side installs and runs with its own extra alone, in an environment of its own."""

import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest

from tests.helpers.repository import ROOT

pytestmark = pytest.mark.install


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    return subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, timeout=1200, env=environment, check=False
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    built = run(sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-w", folder, ROOT)
    assert built.returncode == 0, built.stderr
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def constraints(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The lock's versions. Its hashes cannot stay: a wheel that was built just now has none in it."""
    pins = re.findall(r"^[a-z0-9][^\s\\]*==[^\\]*", (ROOT / "requirements.lock").read_text(), flags=re.MULTILINE)
    assert len(pins) > 50
    path = tmp_path_factory.mktemp("constraints") / "constraints.txt"
    path.write_text("\n".join(pin.strip() for pin in pins) + "\n")
    return path


def installed(extra: str, wheel: Path, constraints: Path, folder: Path) -> Path:
    """The bin folder of a new environment with that extra alone."""
    venv.create(folder, with_pip=True)
    install = run(
        folder / "bin/python", "-m", "pip", "install", "-q", "-c", constraints, f"feelahead[{extra}] @ {wheel.as_uri()}"
    )
    assert install.returncode == 0, install.stderr
    return folder / "bin"


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


def absent(bin_folder: Path, *modules: str) -> None:
    for module in modules:
        found = run(bin_folder / "python", "-c", f"import {module}")
        assert "ModuleNotFoundError" in found.stderr, f"{module} is installed"


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
