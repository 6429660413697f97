"""Virtual environments for tests of installation, and commands that run in them."""

import os
import subprocess
import venv
from pathlib import Path


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a command without the variables by which it would find the packages of the test run."""
    environment = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    return subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, timeout=1200, env=environment, check=False
    )


def wanted(wheel: Path, extra: str = "") -> str:
    """Return pip's requirement for the wheel with an extra; without one if `extra` is empty."""
    return f"feelahead{extra and f'[{extra}]'} @ {wheel.as_uri()}"


def installed(extra: str, wheel: Path, constraints: Path, folder: Path) -> Path:
    """Install the wheel with this one extra, or with none, in a new environment; return its bin folder."""
    venv.create(folder, with_pip=True)
    install = run(folder / "bin/python", "-m", "pip", "install", "-q", "-c", constraints, wanted(wheel, extra))
    assert install.returncode == 0, install.stderr
    return folder / "bin"


def absent(bin_folder: Path, *modules: str) -> None:
    """Assert that none of these modules can be imported in an environment."""
    for module in modules:
        found = run(bin_folder / "python", "-c", f"import {module}")
        assert "ModuleNotFoundError" in found.stderr, f"{module} is installed"
