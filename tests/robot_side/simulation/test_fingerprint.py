"""What tells an arm: its joints, links and limits, and nothing of where it stands or what stands around it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from robot_side.enlargement.prediction_errors import BUILT_IN, load_prediction_errors
from robot_side.simulation.scene import load_scene
from tests.helpers.arm_models import MOTORS, SHAPES, STONE, planar_arm
from tests.helpers.repository import ROOT


def built_in() -> str:
    return load_scene().robot.fingerprint


@pytest.mark.parametrize("name", ["wall", "cluttered", "table_mesh", "u_mesh"])
def test_the_built_in_arm_is_the_same_in_every_scene_and_start_pose(name: str) -> None:
    frozen = load_scene(ROOT / "tests" / "data" / f"{name}.xml", "tool")
    assert frozen.robot.fingerprint == built_in()


def test_the_built_in_table_of_prediction_errors_is_for_the_built_in_arm() -> None:
    assert load_prediction_errors(BUILT_IN).arm == built_in()


@pytest.mark.parametrize(
    "write",
    [
        lambda path: planar_arm(path, base="1 2 0", yaw_deg=30.0),
        lambda path: planar_arm(path, world=SHAPES, extra_top=STONE),
        lambda path: planar_arm(path, arm_actuators=MOTORS),
    ],
    ids=["stands elsewhere", "among things", "other motors"],
)
def test_where_an_arm_stands_and_what_drives_it_makes_no_other(write: Callable[[Path], Path], tmp_path: Path) -> None:
    plain = load_scene(planar_arm(tmp_path), "tcp").robot.fingerprint
    assert load_scene(write(tmp_path), "tcp").robot.fingerprint == plain


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('range="-170 170"', 'range="-160 170"'),
        ('<body name="lower" pos="0.3 0 0">', '<body name="lower" pos="0.31 0 0">'),
        ('<joint name="elbow" axis="0 1 0"', '<joint name="elbow" axis="0 0.1 1"'),
        ('<joint name="elbow" axis', '<joint name="elbow" pos="0 0.01 0" axis'),
        ('<site name="tcp" pos="0 0 0.08"/>', '<site name="tcp" pos="0 0 0.09"/>'),
    ],
    ids=["a limit", "a link", "an axis", "where it turns", "the tool"],
)
def test_another_limit_link_axis_or_tool_makes_another(old: str, new: str, tmp_path: Path) -> None:
    file = planar_arm(tmp_path)
    plain = load_scene(file, "tcp").robot.fingerprint
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    other = load_scene(file, "tcp").robot.fingerprint
    assert other not in {plain, built_in()}
    assert len(other) == 12
    assert set(other) <= set("0123456789abcdef")
