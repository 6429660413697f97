"""The wheel and the sdist: every file of the packages, no test, and one from the other."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.helpers.installing import run
from tests.helpers.repository import ROOT

pytestmark = [pytest.mark.install, pytest.mark.xdist_group("base")]

PACKAGES = ("common", "feelahead", "operator_side", "robot_side")
TELLING = {
    "robot_side/py.typed",
    "robot_side/enlargement/prediction_errors.toml",
    "robot_side/simulation/assets/arm.xml",
    "operator_side/dualsense/hid/release_watchdog.py",
    "feelahead/lab/reference/peer_driver.cpp",
}


def content(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_the_wheel_holds_the_packages_and_nothing_else(wheel: Path) -> None:
    held = content(wheel)
    files = {
        path.relative_to(ROOT).as_posix(): path.read_bytes()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert files.keys() >= TELLING
    assert {name: data for name, data in held.items() if ".dist-info/" not in name} == files
    [metadata] = [data.decode() for name, data in held.items() if name.endswith(".dist-info/METADATA")]
    for extra in ("robot", "operator", "record", "bench", "experiments"):
        assert f"Provides-Extra: {extra}\n" in metadata


def test_the_sdist_builds_the_same_wheel(wheel: Path, tmp_path: Path) -> None:
    made = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    [sdist] = tmp_path.glob("*.tar.gz")
    again = tmp_path / "again"
    built = run(sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-w", again, sdist)
    assert built.returncode == 0, built.stderr
    assert content(next(again.glob("*.whl"))) == content(wheel)
