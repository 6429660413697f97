"""House rule 1: who may import what. The tree is read as text, so that lazy imports count too."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.helpers.repository import ROOT

PACKAGES = ("common", "robot_side", "operator_side", "feelahead")
MAY_IMPORT = {
    "common": {"common"},
    "robot_side": {"common", "robot_side"},
    "operator_side": {"common", "operator_side"},
    "feelahead": set(PACKAGES),
}
IO_ROOMS = {
    "zmq": {
        *(f"common/sockets/{part}.py" for part in ("shell", "authentication", "robot", "operator")),
        "feelahead/benchmarks/link/peers.py",  # times bare ZeroMQ beside ours
    },
    "hid": {"operator_side/dualsense/hid/device.py"},
    "hidraw": {"operator_side/dualsense/hid/device.py"},
    "mujoco": {
        "robot_side/simulation/arm.py",
        "robot_side/simulation/scene.py",
        "feelahead/benchmarks/overlap/distances.py",  # times MuJoCo's distances beside our overlaps
    },
    "viser": {"operator_side/console.py"},
}
CLOCK_READERS = {
    "common/clock.py",  # the clock
    "feelahead/benchmarks/link/wake_error.py",  # measures a clock's loop
    "feelahead/experiments/hostile/run.py",  # drives two real processes
    "feelahead/commands/calibrate.py",  # shows a real controller to a person
    "feelahead/commands/demo.py",  # shows two real processes to a person
    "operator_side/dualsense/hid/release_watchdog.py",  # a bare file that imports nothing of ours
    "robot_side/main.py",  # times its own ticks
    "feelahead/both_sides/loopback.py",  # likewise
}


def sources() -> list[Path]:
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            first = node.args[0]
            assert isinstance(first, ast.Constant), f"{path}: a computed import escapes this test"
            yield str(first.value)


@pytest.mark.parametrize("path", sources(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_stay_in_their_rooms(path: Path) -> None:
    name = path.relative_to(ROOT).as_posix()
    package = name.split("/")[0]
    for module in imports(path):
        top = module.split(".")[0]
        if top in PACKAGES:
            assert top in MAY_IMPORT[package], f"{name} imports {module}"
        if top in IO_ROOMS:
            assert name in IO_ROOMS[top], f"{name} imports {module}; allowed in {sorted(IO_ROOMS[top])}"
        if top == "time":
            assert name in CLOCK_READERS, f"{name} reads a clock of its own; take `now_s` as an argument"


def test_the_rooms_exist() -> None:
    # Without this, a renamed file would leave a rule that guards nothing.
    for rooms in (
        IO_ROOMS["zmq"],
        IO_ROOMS["hidraw"],
        IO_ROOMS["mujoco"],
        CLOCK_READERS,
    ):
        for room in rooms:
            assert (ROOT / room).is_file(), room


def test_every_module_is_short_enough_to_read() -> None:
    lengths = {path.relative_to(ROOT).as_posix(): len(path.read_text().splitlines()) for path in sources()}
    assert {name: length for name, length in lengths.items() if length > 400} == {}
