"""The architecture as a test: which rooms (folders) may import which, and which may use outside libraries or a clock.

The source is parsed but not run, so that imports within functions count, too. docs/architecture.md explains each room.
"""

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.helpers.repository import ROOT

PACKAGES = ("common", "robot_side", "operator_side", "feelahead")
ARCHITECTURE = ROOT / "docs" / "architecture.md"

ARROWS = """
    common/files: common
    common/emulation: common common/files
    common/link_model.py: common/emulation
    common/timing: common
    common/rate: common
    common/protocol: common common/rate common/timing
    common/realtime: common
    common/companion:
    common/recording: common common/companion common/protocol common/status
    common/video: common/protocol
    common/sockets: common common/files
    common/sockets/door: common common/companion common/realtime common/sockets
    common/status: common/protocol
    common/command: common common/emulation common/files common/protocol common/recording common/status
    common/loop: common common/command common/files common/realtime common/recording

    robot_side/compiled: common common/files
    robot_side/overlap/checks: common
    robot_side/operators: common common/emulation common/protocol
    robot_side/tick/truth.py: common
    robot_side/overlap/digits: common robot_side/compiled
    robot_side/arm: common common/files common/protocol robot_side/compiled
    robot_side/enlargement: common common/protocol robot_side/compiled
    robot_side/overlap/solids: common robot_side/compiled robot_side/overlap/digits
    robot_side/overlap/precise: common robot_side/compiled robot_side/overlap/digits robot_side/overlap/solids
    robot_side/overlap/meshes: common robot_side/compiled robot_side/overlap/checks robot_side/overlap/digits
        robot_side/overlap/solids
    robot_side/overlap: common robot_side/compiled robot_side/overlap/checks robot_side/overlap/meshes
        robot_side/overlap/precise robot_side/overlap/solids
    robot_side/surroundings/kinds: common robot_side/compiled robot_side/overlap/meshes robot_side/overlap/solids
    robot_side/surroundings: common robot_side/compiled robot_side/overlap/meshes
        robot_side/surroundings/kinds
    robot_side/field: common robot_side/arm robot_side/compiled robot_side/enlargement robot_side/surroundings
        robot_side/surroundings/kinds
    robot_side/depth: common robot_side/compiled robot_side/surroundings robot_side/surroundings/kinds
    robot_side/depth/surfel_map: common robot_side/compiled robot_side/depth
    robot_side/depth/octree: common robot_side/compiled robot_side/depth robot_side/depth/surfel_map
    robot_side/depth/motion: common robot_side/compiled robot_side/depth robot_side/depth/surfel_map
    robot_side/depth/pointing.py: common robot_side/depth robot_side/depth/surfel_map
    robot_side/depth/depth_map.py: common robot_side/depth robot_side/depth/motion robot_side/depth/octree
        robot_side/depth/pointing.py robot_side/depth/surfel_map
    robot_side/depth/perception.py: common robot_side/depth robot_side/depth/depth_map.py robot_side/surroundings
    robot_side/gripper: common common/files robot_side/arm robot_side/overlap/meshes robot_side/surroundings
    robot_side/tick: common common/protocol robot_side/arm robot_side/surroundings
    robot_side/commissioning: common common/command common/sockets/door robot_side/arm robot_side/compiled
        robot_side/depth robot_side/depth/perception.py robot_side/drivers/mujoco
        robot_side/drivers/mujoco/depth_cameras robot_side/drivers/mujoco/drawing robot_side/drivers/remote
        robot_side/parts.py robot_side/perceiving robot_side/settings.py
    robot_side/drivers/remote: common common/protocol common/sockets/door common/timing robot_side/arm robot_side/depth
        robot_side/overlap/meshes
        robot_side/surroundings
    robot_side/laws: common common/files common/protocol robot_side/arm robot_side/enlargement robot_side/field
        robot_side/laws/paper_settings.py robot_side/surroundings robot_side/tick
    robot_side/drivers/mujoco: common common/files common/protocol robot_side/arm robot_side/compiled robot_side/gripper
        robot_side/overlap/meshes robot_side/surroundings
        robot_side/surroundings/kinds robot_side/tick/truth.py
    robot_side/drivers/mujoco/depth_cameras: common robot_side/depth robot_side/depth/perception.py
        robot_side/drivers/mujoco robot_side/drivers/mujoco/drawing robot_side/surroundings robot_side/tick
    robot_side/perceiving: common common/companion common/files common/realtime common/sockets/door robot_side/arm
        robot_side/compiled robot_side/depth robot_side/depth/perception.py robot_side/drivers/mujoco
        robot_side/drivers/mujoco/depth_cameras robot_side/drivers/mujoco/drawing robot_side/drivers/remote
        robot_side/settings.py robot_side/surroundings robot_side/surroundings/kinds robot_side/tick
    robot_side/reporting: common common/emulation common/protocol common/rate common/sockets common/sockets/door
        robot_side/arm
        robot_side/operators robot_side/tick
    robot_side/outcome: common robot_side/tick robot_side/tick/truth.py
    robot_side/recording: common common/protocol common/recording robot_side/arm robot_side/outcome
        robot_side/surroundings robot_side/tick robot_side/tick/truth.py
    robot_side/laws/named.py: common/files robot_side/laws robot_side/tick
    robot_side/laws/paper_settings.py:
    robot_side/drivers/mujoco/checks: common robot_side/arm robot_side/drivers/mujoco
    robot_side/core: common common/protocol common/status common/timing robot_side/arm robot_side/gripper
        robot_side/laws robot_side/operators robot_side/outcome robot_side/reporting robot_side/surroundings
        robot_side/tick
    robot_side/viewing: common common/companion common/protocol common/realtime robot_side/drivers/mujoco
        robot_side/drivers/mujoco/drawing robot_side/operators robot_side/surroundings robot_side/tick
    robot_side/settings.py: common common/command common/files robot_side/arm robot_side/depth robot_side/drivers/mujoco
        robot_side/enlargement robot_side/laws/named.py robot_side/laws/paper_settings.py robot_side/operators
        robot_side/viewing
    robot_side/parts.py: common common/protocol common/timing robot_side/arm robot_side/compiled
        robot_side/core robot_side/laws
        robot_side/drivers/mujoco robot_side/drivers/mujoco/checks robot_side/drivers/remote robot_side/gripper
        robot_side/laws/named.py robot_side/operators robot_side/perceiving robot_side/settings.py
        robot_side/surroundings
    robot_side: common common/command common/emulation common/files common/loop common/protocol common/recording
        common/sockets/door common/status robot_side/arm robot_side/commissioning robot_side/compiled robot_side/core
        robot_side/drivers/mujoco robot_side/drivers/remote robot_side/parts.py robot_side/perceiving
        robot_side/recording robot_side/reporting robot_side/settings.py robot_side/tick robot_side/viewing

    operator_side/controller: common common/status
    operator_side/dualsense/effects: operator_side/controller
    operator_side/dualsense/reports: common operator_side/controller operator_side/dualsense/effects
    operator_side/dualsense/hid: common operator_side/controller operator_side/dualsense/reports
    operator_side/dualsense/simulated: common operator_side/controller operator_side/dualsense/reports
    operator_side/dualsense/uhid: common common/realtime operator_side/dualsense/reports
        operator_side/dualsense/simulated
    operator_side/evdev: common operator_side/controller
    operator_side/hands: common common/protocol operator_side/controller
    operator_side/robot_link: common common/emulation common/protocol common/rate common/sockets common/status
        operator_side/hands
    operator_side/events.py: operator_side/controller operator_side/robot_link
    operator_side/feel: common common/protocol common/status operator_side/controller operator_side/hands
    operator_side/calibration: common common/files operator_side/controller operator_side/hands
    operator_side/people: common common/files common/protocol common/status operator_side/calibration
        operator_side/controller operator_side/dualsense/simulated operator_side/hands
    operator_side/core_settings.py: common common/protocol operator_side/feel operator_side/hands
    operator_side/core.py: common common/protocol common/status operator_side/controller operator_side/core_settings.py
        operator_side/events.py operator_side/feel operator_side/hands operator_side/robot_link
    operator_side/settings.py: common common/command common/files common/protocol common/sockets
        operator_side/controller operator_side/feel operator_side/hands operator_side/people
    operator_side/viewing/facts.py: common/protocol common/status
    operator_side/viewing/terminal: common common/command common/companion common/status operator_side/controller
        operator_side/viewing/facts.py
    operator_side/viewing/pages: common common/protocol common/status operator_side/controller operator_side/core.py
        operator_side/dualsense/simulated operator_side/hands operator_side/people operator_side/viewing/facts.py
    operator_side/viewing/console: common common/command common/companion common/protocol common/realtime common/status
        common/video operator_side/controller operator_side/viewing/facts.py
    operator_side/viewing: common common/command common/protocol common/rate common/recording common/status
        operator_side/controller operator_side/core.py operator_side/settings.py operator_side/viewing/console
        operator_side/viewing/facts.py operator_side/viewing/pages
    operator_side: common common/command common/emulation common/files common/loop common/protocol common/recording
        common/sockets common/status operator_side/calibration operator_side/controller operator_side/core.py
        operator_side/core_settings.py operator_side/dualsense/hid operator_side/dualsense/simulated
        operator_side/evdev operator_side/events.py operator_side/hands operator_side/people
        operator_side/robot_link operator_side/settings.py operator_side/viewing operator_side/viewing/console
        operator_side/viewing/pages operator_side/viewing/terminal

    feelahead/both_sides: common/* robot_side/* operator_side/*
    feelahead/recordings: common/* robot_side/* operator_side/*
    feelahead/containers: common/* feelahead/both_sides
    feelahead/workers.py: common
    feelahead/printing: common
    feelahead/lab: common/* robot_side/* operator_side/* feelahead/both_sides feelahead/containers feelahead/printing
        feelahead/workers.py
    feelahead/study/report: common common/files feelahead/printing feelahead/study
        feelahead/study/trials
    feelahead/study: common common/command common/files robot_side/drivers/mujoco robot_side/laws/named.py
    feelahead/commands/bench_and_try.py: common common/files feelahead/lab
    feelahead/study/trials: common common/recording robot_side/laws/paper_settings.py robot_side/settings.py
        operator_side operator_side/people operator_side/settings.py feelahead/both_sides
        feelahead/printing feelahead/study feelahead/workers.py
    feelahead/commands/study: common common/command common/recording common/status operator_side/viewing/console
        feelahead/both_sides feelahead/commands/demo feelahead/printing feelahead/study feelahead/study/report
        feelahead/study/trials
    feelahead/commands: common/* robot_side/commissioning robot_side/compiled robot_side/depth robot_side/drivers/mujoco
        robot_side/laws/named.py robot_side/laws/paper_settings.py robot_side/settings.py robot_side/viewing
        operator_side/* feelahead/both_sides feelahead/printing feelahead/recordings
    feelahead: common/*
    feelahead/__init__.py: common/* robot_side/* operator_side/* feelahead/both_sides
"""
"""One row for each room: the room, and the rooms that it may import.

`X` means the files directly in folder X, or the file X if it has a row. `X/*` means also the files in X's subfolders.
A file or folder without a row belongs to the room around it.
"""

LIBRARIES = {
    "viser": ("operator_side/viewing/console",),
    "trimesh": ("operator_side/viewing/console",),
    "websockets": ("operator_side/viewing/console", "feelahead/commands/study"),
    "zmq": ("common/sockets", "feelahead/lab/link/bare.py"),
    "hid": ("operator_side/dualsense/hid/device.py",),
    "hidraw": ("operator_side/dualsense/hid/device.py",),
    "mujoco": ("robot_side/drivers/mujoco", "robot_side/viewing"),
    "numba": ("robot_side/compiled",),
    "llvmlite": ("robot_side/compiled",),
    "av": ("common/video", "robot_side/viewing"),
    "foxglove": ("common/recording",),
    "mcap": ("common/recording",),
    # A wall clock may jump by an hour, so it must not be available; a recording's stamps use that clock.
    "datetime": ("feelahead/recordings",),
    "calendar": (),
    "common.clock.wall_clock_offset_s": ("common/recording", "robot_side/main.py"),
    "time": (
        "common/clock.py",
        "operator_side/dualsense/hid/release_watchdog.py",
        "feelahead/lab",
        "feelahead/commands",
        "feelahead/containers",
        "feelahead/lab",
    ),
    "common.clock.MonotonicClock": (
        "common/sockets/shell.py",
        "common/sockets/door",
        "common/recording",
        "common/loop",
        "robot_side/viewing",
        "robot_side/perceiving",
        "robot_side/compiled/warm_up.py",
        "robot_side/gripper/kept_covers.py",
        "operator_side/viewing/terminal",
        "feelahead/lab",
        "feelahead/both_sides",
        "feelahead/commands",
        "feelahead/printing",
    ),
}
"""Rooms and files that may import each library, or use a clock"""


PLAN = {"common": (30, 56, 7), "robot_side": (25, 100, 12), "operator_side": (20, 70, 9)}
"""Most rooms, arrows and floors of a package. Here each file or folder directly in the package is a room.

Arrow: some file of one room imports a file of the other. Floors: rooms in the longest chain of arrows.
"""


def _read_arrows() -> dict[str, tuple[str, ...]]:
    rows = ARROWS.replace("\n        ", " ").strip().splitlines()
    return {room.strip(): tuple(to.split()) for room, _, to in (row.partition(":") for row in rows)}


ALLOWED = _read_arrows()


@cache
def modules() -> Mapping[str, Path]:
    """Return the file of each module of this project, by the module's name."""
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            name = path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
            found[name.removesuffix(".__init__")] = path
    return found


@cache
def imports(path: Path) -> frozenset[str]:
    """Return the modules that the file `path` imports.

    A string that is the name of a module counts, too, as it may be used to import the module.
    """
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name for name in names if name in modules() or name in LIBRARIES}
            if any(name not in modules() for name in names):
                found.add(node.module)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and "." in node.value:
            found |= {node.value} & modules().keys()
    return frozenset(found)


@cache
def room_of(path: Path) -> str:
    """Return the innermost room of ARROWS that contains `path`; the package if no row does."""
    name = path.relative_to(ROOT)
    return next((room.as_posix() for room in (name, *name.parents) if room.as_posix() in ALLOWED), name.parts[0])


def _permits(entry: str, folder: str) -> bool:
    return folder == entry or (entry.endswith("/*") and f"{folder}/".startswith(entry.removesuffix("*")))


def _lies_in(path: Path, place: str) -> bool:
    name = path.relative_to(ROOT).as_posix()
    return name == place or name.startswith(f"{place}/")


def _entry(path: Path) -> tuple[str, ...]:
    """Return the package of `path`, and the entry of the package's folder that contains it."""
    return path.relative_to(ROOT).with_suffix("").parts[:2]


def every_import() -> Iterator[tuple[Path, str]]:
    return ((path, module) for path in modules().values() for module in sorted(imports(path)))


def test_imports_follow_the_arrows() -> None:
    for path, module in every_import():
        if module in modules():
            room, to, folder = room_of(path), room_of(modules()[module]), modules()[module].parent
            allowed = ALLOWED.get(room, ())
            place = folder.relative_to(ROOT).as_posix()
            assert to == room or to in allowed or any(_permits(entry, place) for entry in allowed), (
                f"{path.relative_to(ROOT)} imports {module}; {room} may import {', '.join(allowed) or 'none of ours'}"
            )


def test_the_world_outside_is_touched_in_its_rooms_alone() -> None:
    for path, module in every_import():
        for library in {module, module.partition(".")[0]} & LIBRARIES.keys():
            assert path == modules()["common.clock"] or any(_lies_in(path, place) for place in LIBRARIES[library]), (
                f"{path.relative_to(ROOT)} imports {library}; allowed in {', '.join(LIBRARIES[library])}"
            )


def test_no_arrow_is_allowed_that_nobody_takes() -> None:
    # An unused permission would let the next import in unseen.
    taken: dict[str, set[str]] = {}
    for path in modules().values():
        folders = {modules()[m].parent.relative_to(ROOT).as_posix() for m in imports(path) if m in modules()}
        files = {room for m in imports(path) if m in modules() and (room := room_of(modules()[m])).endswith(".py")}
        taken.setdefault(room_of(path), set()).update(folders | files)
    idle = [
        (room, entry)
        for room, entries in ALLOWED.items()
        for entry in entries
        if not any(_permits(entry, folder) for folder in taken[room])
    ]
    assert idle == []


def test_no_circle_of_rooms_and_none_of_modules() -> None:
    graph = {
        name: {module for module in imports(path) if module in modules()} - {name} for name, path in modules().items()
    }
    rooms: dict[str, set[str]] = {}
    for name, wanted in graph.items():
        rooms.setdefault(room_of(modules()[name]), set()).update(room_of(modules()[module]) for module in wanted)
    for kind in (graph, {room: to - {room} for room, to in rooms.items()}):
        try:
            list(TopologicalSorter(kind).static_order())
        except CycleError as error:
            pytest.fail(f"a circle: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize("package", PLAN)
def test_the_plan_does_not_creep(package: str) -> None:
    below: dict[str, set[str]] = {}
    for path in modules().values():
        mine, *entry = _entry(path)
        if mine == package and entry != ["__init__"]:
            others = [_entry(modules()[module]) for module in imports(path) if module in modules()]
            below.setdefault(entry[0], set()).update(other[1] for other in others if other[0] == package)
    floors: dict[str, int] = {}
    graph = {room: to - {room} for room, to in below.items()}
    for room in TopologicalSorter(graph).static_order():
        floors[room] = 1 + max((floors[other] for other in graph[room]), default=0)
    found = len(graph), sum(map(len, graph.values())), max(floors.values())
    assert all(count <= most for count, most in zip(found, PLAN[package], strict=True)), (
        f"{package} has {found} rooms, arrows and floors; valid: at most {PLAN[package]}"
    )


def test_every_named_place_exists() -> None:
    # Without this, a renamed file would leave a rule that guards nothing.
    places = {*ALLOWED, *(place for allowed in LIBRARIES.values() for place in allowed)}
    assert [place for place in sorted(places) if not (ROOT / place).exists()] == []


def test_every_exemption_is_explained() -> None:
    text = ARCHITECTURE.read_text(encoding="utf-8")
    files = {place for allowed in LIBRARIES.values() for place in allowed if place.endswith(".py")}
    assert [place for place in sorted(files) if f"`{place}`" not in text] == []


def test_every_module_is_short_enough_to_read() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in modules().values()}
    assert {str(path): length for path, length in lengths.items() if length > 310} == {}


def test_no_folder_is_too_full_to_find_anything() -> None:
    folders = [folder for package in (*PACKAGES, "tests") for folder in [ROOT / package, *(ROOT / package).rglob("*/")]]
    counts = {folder: len([path for path in folder.glob("*.py") if path.name != "__init__.py"]) for folder in folders}
    assert {str(folder): count for folder, count in counts.items() if count > 20} == {}
