"""The wheel installs and its commands run, in separate environments: with each extra by itself, and with none."""

import json
import re
import sys
import zipfile
from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.helpers.installing import absent, installed, run, wanted
from tests.helpers.repository import ROOT

pytestmark = [pytest.mark.install, pytest.mark.xdist_group("base")]

PACKAGES = ("common", "feelahead", "operator_side", "robot_side")
TELLING = {
    "robot_side/py.typed",
    "robot_side/enlargement/prediction_errors.toml",
    "robot_side/drivers/mujoco/assets/arm.xml",
    "operator_side/dualsense/hid/release_watchdog.py",
}
EXTRAS = {
    "record": {"foxglove-sdk", "mcap"},
    "bench": {"mpmath", "overlap"},
    "experiments": {"matplotlib", "pyarrow", "distributed"},
}
OF_THE_SIDES = {"mujoco-core", "mujoco", "numba", "simplejpeg", "hidapi", "viser"}


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="session")
def constraints(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """File with the versions of the lock, without hashes: with these, pip would demand one for the new wheel, too."""
    pins = re.findall(r"^[a-z0-9][^\s\\]*==[^\\]*", (ROOT / "requirements.lock").read_text(), flags=re.MULTILINE)
    assert len(pins) > 50
    path = tmp_path_factory.mktemp("constraints") / "constraints.txt"
    path.write_text("\n".join(pin.strip() for pin in pins) + "\n")
    return path


@pytest.fixture(scope="module")
def base(wheel: Path, constraints: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bin folder of an environment in which the wheel is installed without extras."""
    bin_folder = installed("", wheel, constraints, tmp_path_factory.mktemp("base"))
    absent(bin_folder, "mujoco", "numba", "hid", "hidraw", "viser", "mcap", "matplotlib", "pyarrow")
    return bin_folder


def built(source: Path, folder: Path) -> Path:
    """Build a wheel from `source`, a checkout or an sdist; return the wheel's path."""
    made = run(sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-w", folder, source)
    assert made.returncode == 0, made.stderr
    return next(folder.glob("*.whl"))


def content(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_the_wheel_holds_the_packages_and_nothing_else_and_so_does_the_sdists(wheel: Path, tmp_path: Path) -> None:
    held = content(wheel)
    files = {
        path.relative_to(ROOT).as_posix(): path.read_bytes()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert files.keys() >= TELLING
    assert {name: data for name, data in held.items() if ".dist-info/" not in name} == files
    made = run("env", "-C", ROOT, sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path)
    assert made.returncode == 0, made.stderr
    assert content(built(next(tmp_path.glob("*.tar.gz")), tmp_path / "again")) == held


@pytest.mark.parametrize(
    "arguments",
    [
        ["feelahead", "--help"],
        ["feelahead", "--version"],
        ["feelahead", "demo", "--help"],
        ["feelahead", "keys", "make", "robot", "--folder", "{tmp}/keys"],
        ["feelahead", "bench", "--list"],
        ["feelahead", "try", "--list"],
        ["feelahead", "virtual-dualsense", "--help"],
        ["feelahead", "calibrate", "--device", "simulated"],
        ["feelahead-operator", "--help"],
        ["feelahead-operator", "--device", "simulated", "--duration", "0.5", "--status", "none"],
    ],
    ids=" ".join,
)
def test_what_works_without_extras(base: Path, tmp_path: Path, arguments: list[str]) -> None:
    program, *rest = arguments
    ended = run(base / program, *(word.replace("{tmp}", str(tmp_path)) for word in rest))
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("feelahead-robot", "pip install '.[robot]'"),
        ("feelahead demo --duration 1", "pip install '.[robot]'"),
        ("feelahead bench overlap", "pip install '.[robot,experiments,bench]'"),
        ("feelahead try haptics", "pip install '.[robot,operator]'"),
        ("feelahead-operator --device hid --duration 0.5", "hidapi"),
    ],
)
def test_what_needs_an_extra_says_which(base: Path, command: str, said: str) -> None:
    program, *rest = command.split()
    ended = run(base / program, *rest)
    assert ended.returncode == 2
    [line] = ended.stderr.splitlines()
    assert said in line


def test_the_robot_side_alone(wheel: Path, constraints: Path, tmp_path: Path) -> None:
    bin_folder = installed("robot", wheel, constraints, tmp_path / "robot")
    absent(bin_folder, "hid", "hidraw", "viser")
    ended = run(bin_folder / "feelahead-robot", "--bind", "tcp://127.0.0.1:0", "--duration", "0.5", "--status", "none")
    assert (ended.returncode, ended.stderr) == (0, "")


def test_the_operator_side_alone(wheel: Path, constraints: Path, tmp_path: Path) -> None:
    bin_folder = installed("operator", wheel, constraints, tmp_path / "operator")
    absent(bin_folder, "mujoco", "numba", "simplejpeg")
    program = bin_folder / "feelahead-operator"
    ended = run(program, "--connect", "tcp://127.0.0.1:9", "--device", "simulated", "--duration", "0.5")
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_can_be_had_alone(base: Path, wheel: Path, constraints: Path, tmp_path: Path, extra: str) -> None:
    """The extra installs in the locked versions, and without packages that only other extras need."""
    report = tmp_path / "report.json"
    install = (base / "python", "-m", "pip", "install", "-q", "-c", constraints)
    tried = run(*install, "--dry-run", "--report", report, wanted(wheel, extra))
    assert tried.returncode == 0, tried.stderr
    names = normalised(one["metadata"]["name"] for one in json.loads(report.read_text())["install"])
    assert names >= EXTRAS[extra]
    assert not names & OF_THE_SIDES
    if extra == "record":  # Small enough for a real installation, beside the base.
        beside = tmp_path / "record"
        put = run(*install, "--no-deps", "--target", beside, *names - {"feelahead"})
        assert put.returncode == 0, put.stderr
        code = f"import sys; sys.path.append({str(beside)!r}); import foxglove, mcap.reader, mcap.writer"
        imported = run(base / "python", "-c", code)
        assert (imported.returncode, imported.stderr) == (0, "")


def normalised(names: Iterable[str]) -> set[str]:
    return {re.sub(r"[-_.]+", "-", name).lower() for name in names}
