"""The wheel installs and its commands run: with each extra by itself, and with none."""

import json
import sys
import zipfile
from importlib.metadata import PathDistribution
from pathlib import Path

import pytest

from tests.helpers.machines.installing import installed, link_packages, run
from tests.helpers.repository import ROOT

pytestmark = [pytest.mark.install, pytest.mark.xdist_group("wheel")]

PACKAGES = ("common", "feelahead", "operator_side", "robot_side")
TELLING = {
    "robot_side/py.typed",
    "robot_side/enlargement/prediction_errors.toml",
    "robot_side/drivers/mujoco/assets/arm.xml",
    "operator_side/dualsense/hid/release_watchdog.py",
}
MODULES = {
    "": "",
    "robot": "mujoco numba simplejpeg",
    "operator": "hid hidraw viser trimesh",
    "video": "av",
    "recorded": "rosbags",
    "tags": "cv2",
    "record": "foxglove mcap.reader mcap.writer",
    "bench": "mpmath overlap",
    "experiments": "matplotlib pyarrow distributed",
    "study": "statsmodels pandas pyarrow matplotlib",
}
"""Modules that can be imported with each extra, and only with the extras that name them"""
COMMANDS = {
    "": {
        "feelahead --help": "",
        "feelahead demo --help": "",
        "feelahead keys make robot --folder {folder}/keys": "",
        "feelahead bench --list": "",
        "feelahead try --list": "",
        "feelahead virtual-dualsense --help": "",
        "feelahead controller --calibrate --device simulated": "",
        "feelahead-operator --help": "",
        "feelahead-operator --device simulated --duration 0.5 --status none": "",
        "feelahead-robot": "pip install 'feelahead[robot]'",
        "feelahead demo --duration 1": "pip install 'feelahead[robot]'",
        "feelahead bench overlap": "pip install 'feelahead[robot,experiments,bench]'",
        "feelahead try haptics": "pip install 'feelahead[robot,operator]'",
        "feelahead-operator --device hid --duration 0.5": "hidapi",
    },
    "robot": {"feelahead-robot --bind tcp://127.0.0.1:0 --duration 0.5 --status none": ""},
    "operator": {"feelahead-operator --connect tcp://127.0.0.1:9 --device simulated --duration 0.5": ""},
    "record": {
        "feelahead-operator --device simulated --duration 2 --status none --record {folder}/run.mcap": "",
        "feelahead export {folder}/run.mcap": "",
        "feelahead replay {folder}/run.mcap --check": "",
        "feelahead plot {folder}/run.mcap": "pip install 'feelahead[experiments]'",
        "feelahead export {folder}/run.mcap --format parquet": "pip install 'feelahead[experiments]'",
    },
}
"""Commands by extra, and what each that needs another extra says"""
RUNS = """
import contextlib, importlib, importlib.metadata, importlib.util, io, json, sys
present, absent, commands = json.loads(sys.argv[1])
sys.OpenCV_REPLACE_SYS_PATH_0 = True  # behind a link cv2 does not find its own library otherwise
answers = [[module for module in absent if importlib.util.find_spec(module)]]
mains = {one.name: one.load() for one in importlib.metadata.distribution("feelahead").entry_points}
for command in commands:
    sys.argv, said = command.split(), io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        try:
            mains[sys.argv[0]]()
        except SystemExit as end:
            answers.append([end.code or 0, said.getvalue()])
for module in present:
    importlib.import_module(module)
print(json.dumps(answers))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment in which only the wheel is installed."""
    return installed(wheel, tmp_path_factory.mktemp("base"))


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


@pytest.mark.parametrize("extra", MODULES)
def test_what_works_with_an_extra_alone_and_what_needs_another_says_which(
    python: Path, tmp_path: Path, extra: str
) -> None:
    [metadata] = python.parents[1].glob("lib/python*/site-packages/feelahead-*.dist-info")
    link_packages(PathDistribution(metadata), extra, tmp_path / "packages")
    present = MODULES[extra].split()
    absent = {module for name, modules in MODULES.items() if name != extra for module in modules.split()}
    absent -= {*present}
    said = {command.replace("{folder}", str(tmp_path)): words for command, words in COMMANDS.get(extra, {}).items()}
    asked = json.dumps([present, sorted(module.partition(".")[0] for module in absent), [*said]])
    ended = run(python, "-P", "-c", RUNS, asked, PYTHONPATH=str(tmp_path / "packages"))
    assert (ended.returncode, ended.stderr) == (0, "")
    others, *answers = json.loads(ended.stdout)
    assert others == []
    for (command, words), (code, complaint) in zip(said.items(), answers, strict=True):
        assert code == (2 if words else 0), (command, complaint)
        assert len(complaint.splitlines()) == (1 if words else 0), (command, complaint)
        assert words in complaint, command


def test_its_commands_are_programs(python: Path) -> None:
    [metadata] = python.parents[1].glob("lib/python*/site-packages/feelahead-*.dist-info")
    for one in PathDistribution(metadata).entry_points:
        ended = run(python.with_name(one.name), "--version")
        assert (ended.returncode, ended.stdout.split()[0]) == (0, one.name)
