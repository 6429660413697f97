"""What is installed without any extra works, says what the rest needs, and takes the small extras, each alone."""

import json
import re
from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.helpers.installing import absent, installed, run, wanted

pytestmark = [pytest.mark.install, pytest.mark.xdist_group("base")]

EXTRAS = {
    "record": {"foxglove-sdk", "mcap"},
    "bench": {"matplotlib", "mpmath", "overlap", "pydualsense"},
    "experiments": {"matplotlib", "pyarrow", "distributed"},
}
OF_THE_SIDES = {"mujoco-core", "mujoco", "numba", "simplejpeg", "hidapi", "viser"}


@pytest.fixture(scope="module")
def base(wheel: Path, constraints: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bin folder of an environment with no extra."""
    bin_folder = installed("", wheel, constraints, tmp_path_factory.mktemp("base"))
    absent(bin_folder, "mujoco", "numba", "hid", "hidraw", "viser", "mcap", "matplotlib", "pyarrow")
    return bin_folder


@pytest.mark.parametrize(
    "arguments",
    [
        ["feelahead", "--help"],
        ["feelahead", "--version"],
        ["feelahead", "demo", "--help"],
        ["feelahead", "keys", "--help"],
        ["feelahead", "bench", "--list"],
        ["feelahead", "bench", "link", "--help"],
        ["feelahead", "bench", "link", "--virtual", "--count", "200", "--link", "delay 5ms"],
        ["feelahead", "try", "--list"],
        ["feelahead", "virtual-dualsense", "--help"],
        ["feelahead", "calibrate", "--device", "simulated"],
        ["feelahead-operator", "--help"],
        ["feelahead-operator", "--device", "simulated", "--duration", "0.5", "--status", "none"],
    ],
    ids=" ".join,
)
def test_what_works_without_extras(base: Path, arguments: list[str]) -> None:
    program, *rest = arguments
    ended = run(base / program, *rest)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_keys_are_made_without_extras(base: Path, tmp_path: Path) -> None:
    made = run(base / "feelahead", "keys", "make", "robot", "--folder", tmp_path / "keys")
    assert (made.returncode, made.stderr) == (0, "")
    assert (tmp_path / "keys" / "robot.secret").exists()


@pytest.mark.parametrize(
    ("arguments", "extras"),
    [
        (["feelahead-robot"], "robot"),
        (["feelahead", "demo", "--duration", "1"], "robot"),
        (["feelahead", "bench", "overlap"], "robot,bench"),
        (["feelahead", "try", "haptics"], "robot,operator"),
        (["feelahead", "try", "soak"], "robot,operator"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else value,
)
def test_what_needs_an_extra_says_which(base: Path, arguments: list[str], extras: str) -> None:
    program, *rest = arguments
    ended = run(base / program, *rest)
    assert ended.returncode == 2
    [line] = ended.stderr.splitlines()
    assert line.endswith(f"pip install 'feelahead[{extras}]'")


def test_a_question_of_the_lab_names_the_extras_to_look_in(base: Path) -> None:
    ended = run(base / "feelahead", "bench", "coverage")
    assert ended.returncode == 2
    [line] = ended.stderr.splitlines()
    assert line.endswith("is not installed; it is in one of the extras robot, operator, experiments, bench")


def test_a_controller_needs_the_operators_extra(base: Path) -> None:
    ended = run(base / "feelahead-operator", "--device", "hid", "--duration", "0.5")
    assert ended.returncode == 2
    [line] = ended.stderr.splitlines()
    assert "hidapi" in line


def test_the_recording_extra_alone(base: Path, wheel: Path, constraints: Path, tmp_path: Path) -> None:
    """A real installation, as it is small, beside the base."""
    beside = tmp_path / "record"
    needed = [*EXTRAS["record"], "lz4", "zstandard"]
    put = run(
        *(base / "python", "-m", "pip", "install", "-q", "--no-deps"),
        *("--target", beside, "-c", constraints),
        *needed,
    )
    assert put.returncode == 0, put.stderr
    code = f"import sys; sys.path.append({str(beside)!r}); import foxglove, mcap.reader, mcap.writer"
    imported = run(base / "python", "-c", code)
    assert (imported.returncode, imported.stderr) == (0, "")
    assert normalised(needed) == normalised(resolved(base, "record", wheel, constraints, tmp_path))


@pytest.mark.parametrize("extra", ["bench", "experiments"])
def test_a_large_extra_can_be_had_alone(base: Path, wheel: Path, constraints: Path, tmp_path: Path, extra: str) -> None:
    """In the locked versions, and with nothing that only a side needs."""
    names = resolved(base, extra, wheel, constraints, tmp_path)
    assert names >= EXTRAS[extra]
    assert not names & OF_THE_SIDES


def normalised(names: Iterable[str]) -> set[str]:
    return {re.sub(r"[-_.]+", "-", name).lower() for name in names}


def resolved(base: Path, extra: str, wheel: Path, constraints: Path, folder: Path) -> set[str]:
    """What pip would install for the extra on top of the base."""
    report = folder / "report.json"
    tried = run(
        *(base / "python", "-m", "pip", "install", "-q", "--dry-run", "--report", report),
        *("-c", constraints, wanted(wheel, extra)),
    )
    assert tried.returncode == 0, tried.stderr
    return normalised(one["metadata"]["name"] for one in json.loads(report.read_text())["install"])
