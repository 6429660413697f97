"""Parts of a robot side, made from settings: the law with its table, the gripper's cover, and notes to a person."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import ConfigurationError
from common.roles import Role
from robot_side.core.robot_side import RobotSide
from robot_side.enlargement.distance import Uncertainty
from robot_side.enlargement.prediction_errors import BUILT_IN, load_prediction_errors
from robot_side.laws.paper import PaperLaw
from robot_side.laws.swept import SweptLaw
from robot_side.parts import build_parts
from robot_side.settings import CameraSettings, EncoderSettings, RobotSettings
from tests.helpers.arm_models import COUPLING, planar_arm
from tests.helpers.repository import ROOT

ROWS = "[[{0}]]\nloop_age_ms = 100.0\nmu_mm = 1.0\nsigma_mm = 2.0\n"
NOT_MEASURED = "has not been measured"


def built(**settings: Any) -> RobotSide:
    return RobotSide(build_parts(RobotSettings(**settings), 1, "clock"))


def knows(robot: RobotSide) -> Uncertainty:
    found: Uncertainty = robot.parts.law.assumed.uncertainty  # type: ignore[attr-defined]
    return found


def notes_on_prediction(robot: RobotSide) -> list[str]:
    return [note for note in robot.parts.notes if NOT_MEASURED in note]


@pytest.mark.parametrize(("name", "law"), [("swept", SweptLaw), ("paper", PaperLaw)])
def test_the_law_is_the_one_that_is_set(name: str, law: type) -> None:
    robot = built(law=name)
    assert type(robot.parts.law) is law
    robot.tick(0.0)


def test_the_built_in_arm_has_its_table_in_any_scene() -> None:
    table = load_prediction_errors(BUILT_IN)
    for scene in ({}, {"model": ROOT / "tests" / "data" / "wall.xml", "site": "tool"}):
        robot = built(**scene)
        assert knows(robot).prediction == table
        assert notes_on_prediction(robot) == []


def test_another_arm_has_none_and_its_operator_is_told(tmp_path: Path) -> None:
    robot = built(model=planar_arm(tmp_path), site="tcp")
    assert knows(robot).prediction.rows == {}
    [note] = notes_on_prediction(robot)
    assert "\n" not in note
    assert "feelahead bench error --table" in note
    assert "--prediction-errors" in note


def test_a_table_that_is_named_holds_whatever_the_arm(tmp_path: Path) -> None:
    path = tmp_path / "errors.toml"
    path.write_text(ROWS.format("operator") + ROWS.format("robot"))
    for scene in ({}, {"model": planar_arm(tmp_path), "site": "tcp"}):
        robot = built(prediction_errors=path, **scene)
        assert knows(robot).prediction.at("operator", 0.1, 0.25) == pytest.approx((0.001, 0.002))
        assert notes_on_prediction(robot) == []
    path.write_text("")
    with pytest.raises(ConfigurationError, match=r"errors\.toml"):
        built(prediction_errors=path)


def test_what_errs_is_known_to_the_law_as_it_is_to_the_simulation() -> None:
    robot = built(
        camera=CameraSettings((0.001, -0.002, 0.003), 0.003, 0.004),
        encoder=EncoderSettings(1e-3, 0.0),
        kinematic_mean_m=(0.0, 0.001, 0.0),
        probability=0.9,
    )
    known = knows(robot)
    assert known.camera_mean_m == (0.001, -0.002, 0.003)
    assert known.camera_sd_m == pytest.approx(0.005)
    assert known.kinematic_mean_m == (0.0, 0.001, 0.0)
    assert known.probability == 0.9
    error = robot.parts.camera._error  # type: ignore[attr-defined]
    np.testing.assert_array_equal(error.mean_m, [0.001, -0.002, 0.003])
    assert error.variance_m2 == pytest.approx(0.005**2)
    law = robot.parts.law
    assert isinstance(law, SweptLaw)
    np.testing.assert_allclose(law.looking.ahead.encoder_sigma_rad, 1e-3)


def test_the_gripper_is_covered_as_closely_as_is_set() -> None:
    counts = []
    for cover_m in (0.003, 0.01):
        robot = built(cover_m=cover_m)
        robot.tick(0.0)
        assert robot.newest is not None
        counts.append(len(robot.newest[1].pose.sphere_radii_m))
    assert counts[0] == 246
    assert counts[1] < 50


ROUND_PALM = ('name="palm" type="box"', 'name="palm" type="ellipsoid"')
CAN = '<body name="can" pos="0.9 0 0.3"><freejoint/><geom type="cylinder" size="0.02 0.03"/></body>'
BOX = '<body name="carton" pos="0.9 0 0.3"><freejoint/><geom type="box" size="0.02 0.03 0.04"/></body>'


@pytest.mark.parametrize(
    ("palm", "world", "searches"),
    [(ROUND_PALM, BOX, True), (("", ""), CAN, True), (ROUND_PALM, CAN, True), (("", ""), BOX, False)],
    ids=["gripper", "object", "both", "neither"],
)
def test_a_search_for_spheres_is_announced_only_at_the_first_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, palm: tuple[str, str], world: str, searches: bool
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    model = planar_arm(tmp_path, world=world)
    model.write_text(model.read_text().replace(*palm))
    said: list[list[str]] = [[], []]
    for told in said:
        build_parts(RobotSettings(model=model, site="tcp", cover_m=0.01), 1, "clock", announce=told.append)
    first, again = said
    searching = [line for line in first if line not in again]
    # One line in a few seconds, so a slow machine has several.
    assert {line.partition(":")[0] for line in searching} == (
        {"searching for spheres that cover gripper and objects"} if searches else set()
    )
    # What is known of the model is said before.
    untargeted = next(line for line in again if "no object is a target" in line)
    assert first.index(untargeted) < min([first.index(line) for line in searching], default=len(first))


STRAIGHT = f'{COUPLING}<keyframe><key name="home" qpos="0 0 0 0"/></keyframe>'


@pytest.mark.parametrize(
    ("height_m", "says"), [(0.6, []), (0.26, ["'hand' is 10 mm inside 'carton', 'lower' is 3 mm inside 'carton'"])]
)
def test_a_start_in_collision_is_said(tmp_path: Path, height_m: float, says: list[str]) -> None:
    world = f'<body name="carton" pos="0.6 0 {height_m}"><geom type="box" size="0.03 0.03 0.03"/></body>'
    notes = built(model=planar_arm(tmp_path, world=world, extra_bottom=STRAIGHT), site="tcp").parts.notes
    assert [text.split(": ")[1].split(" (")[0] for text in notes if "starts in collision" in text] == says


def test_flexes_are_told_of_as_nothing_perceives_them(tmp_path: Path) -> None:
    cloth = (
        '<flexcomp name="cloth" type="grid" count="3 3 1" spacing=".03 .03 .03" pos="0.6 0 0.9" radius=".003" dim="2"/>'
    )
    with_cloth, without = (
        built(model=planar_arm(tmp_path, world=world), site="tcp").parts.notes for world in (cloth, "")
    )
    assert [any("flexes" in text for text in notes) for notes in (with_cloth, without)] == [True, False]


BALL = '<body name="ball" pos="0.9 0 0.3"><freejoint/><geom size="0.02"/></body>'
WEDGE = '<body name="wedge" pos="0.9 0 0.3"><freejoint/><geom type="mesh" mesh="wedge"/></body>'
WEDGE_MESH = '<asset><mesh name="wedge" vertex="0 0 0  0.1 0 0  0 0.1 0  0 0 0.1"/></asset><worldbody>'


@pytest.mark.parametrize(
    ("world", "boxes", "tetrahedra"),
    [(BALL, False, False), (BOX, True, False), (WEDGE, False, True), (BOX + WEDGE, True, True)],
    ids=["ball", "box", "tetrahedron", "both"],
)
@pytest.mark.parametrize("role", ["obstacle", "ignored"])
def test_a_scene_needs_no_kernels_for_primitives_that_it_lacks(
    tmp_path: Path, world: str, *, boxes: bool, tetrahedra: bool, role: str
) -> None:
    model = planar_arm(tmp_path, world=world)
    model.write_text(model.read_text().replace("<worldbody>", WEDGE_MESH, 1))
    roles = dict.fromkeys(("carton", "wedge"), Role(role)) if "ball" not in world else {}
    roles = {name: value for name, value in roles.items() if f'"{name}"' in world}
    parts = build_parts(RobotSettings(model=model, site="tcp", roles=roles), 1, "clock")
    needed = {kernel.name.rpartition(".")[2] for kernel in parts.kernels}
    assert needed >= {"look", "sense", "drive"}
    assert ("overlap_one_box" in needed, "overlap_one_tetrahedron" in needed) == (boxes, tetrahedra)


@pytest.mark.processes
def test_a_scene_without_meshes_loads_no_kernel_for_them_and_none_of_the_librarys() -> None:
    program = (
        "import feelahead.both_sides.loopback, robot_side.main\n"
        "from robot_side.core.robot_side import RobotSide\n"
        "from robot_side.parts import build_parts\n"
        "from robot_side.compiled.kernel import imported_kernels\n"
        "from robot_side.settings import RobotSettings\n"
        "parts = build_parts(RobotSettings(), 1, 'clock')\n"
        "RobotSide(parts).tick(0.0)\n"
        "assert not [note for note in parts.notes if 'perceived larger' in note]\n"
        "print(*(kernel.name for kernel in imported_kernels()))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    names = done.stdout.split()
    assert any("kinds.box" in name for name in names)
    assert [name for name in names if "mesh" in name or ".overlap." in name] == []
