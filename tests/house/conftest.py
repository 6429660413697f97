"""The wheel of this checkout, and the versions that it is to be installed with."""

import re
import sys
from pathlib import Path

import pytest

from tests.helpers.installing import run
from tests.helpers.repository import ROOT


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    built = run(sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-w", folder, ROOT)
    assert built.returncode == 0, built.stderr
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="session")
def constraints(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The lock's versions. Its hashes cannot stay: a wheel that was built just now has none in it."""
    pins = re.findall(r"^[a-z0-9][^\s\\]*==[^\\]*", (ROOT / "requirements.lock").read_text(), flags=re.MULTILINE)
    assert len(pins) > 50
    path = tmp_path_factory.mktemp("constraints") / "constraints.txt"
    path.write_text("\n".join(pin.strip() for pin in pins) + "\n")
    return path
