"""The site's axis: turned as asked, and checked against the fingers."""

from pathlib import Path

import numpy as np
import pytest

from robot_side.drivers.mujoco.checks.site_axis import site_findings
from robot_side.drivers.mujoco.gripper_measurement import measure_gripper
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.robot_model import SiteAxis
from robot_side.drivers.mujoco.scene import load_scene
from tests.helpers.arm_models import planar_arm
from tests.helpers.tool_driver import ToolDriver

SITE = '<site name="tcp" pos="0 0 0.08"/>'
ONE_JAW = ('<geom name="right_tip"', '<geom name="right_tip" contype="0" conaffinity="0"')
TURNED: dict[SiteAxis, str] = {"x": "0 90 0", "-x": "0 -90 0", "y": "-90 0 0", "-y": "90 0 0", "-z": "180 0 0"}
"""Rotations (degrees about x, y, z) by which the named axis of a site lies along the hand's z axis"""


def arm_with_site(path: Path, euler: str, place: str = "0 0 0.08") -> Path:
    model = planar_arm(path)
    model.write_text(model.read_text().replace(SITE, f'<site name="tcp" pos="{place}" euler="{euler}"/>'))
    return model


def found(model: Path, axis: SiteAxis = "z") -> list[str]:
    scene = load_scene(model, "tcp", site_axis=axis)
    return site_findings(scene, axis, measure_gripper(scene))


@pytest.mark.parametrize("fits", ["x", "-x", "y", "-y", "-z"])
def test_a_site_off_the_fingers_is_told_the_axis_that_fits(tmp_path: Path, fits: SiteAxis) -> None:
    # The axis that lies along the fingers is the inverse rotation's image of z.
    model = arm_with_site(tmp_path, " ".join(str(-float(angle)) for angle in TURNED[fits].split()))
    [text] = found(model)
    assert f"--site-axis {fits} fits" in text
    assert found(model, fits) == []


def test_the_tool_advances_along_the_named_axis_and_the_law_agrees(tmp_path: Path) -> None:
    model = planar_arm(tmp_path)
    plain, turned = load_scene(model, "tcp"), load_scene(model, "tcp", site_axis="-x")
    before = plain.data.site_xmat[plain.robot.site].reshape(3, 3)
    after = turned.data.site_xmat[turned.robot.site].reshape(3, 3)
    np.testing.assert_allclose(after[:, 2], -before[:, 0], atol=1e-12)
    driver = ToolDriver.load(model, "tcp")
    state = driver.arm.state(0.0)
    pose = MujocoKinematics(turned).pose(state)
    np.testing.assert_allclose(pose.tool_rotation, after, atol=1e-2)


def test_a_site_far_from_the_fingers_is_told_so(tmp_path: Path) -> None:
    model = arm_with_site(tmp_path, "0 0 0", "0 0 0.4")
    # At the demo's table such a site is moved; among surroundings of its own it stays.
    assert found(model) == []
    model.write_text(model.read_text().replace("</worldbody>", '<geom pos="3 0 0" size="0.1"/></worldbody>'))
    [text] = found(model)
    assert "'tcp' stands" in text


def test_a_single_moving_jaw_grips_against_the_link_that_carries_it(tmp_path: Path) -> None:
    model = planar_arm(tmp_path, wrist="")
    text = model.read_text().replace(*ONE_JAW)
    # The wrist's joint makes the hand the last link: beyond it is the left jaw alone.
    text = text.replace('<geom name="palm"', '<joint name="roll" axis="0 0 1" armature="0.1"/><geom name="palm"')
    text = text.replace("<actuator>", '<actuator><position name="roll" joint="roll" kp="100" kv="5"/>')
    text = text.replace(
        '<site name="tcp"', '<geom name="jaw" type="box" pos="0 -0.03 0.06" size="0.01 0.01 0.03"/><site name="tcp"'
    )
    model.write_text(text)
    scene = load_scene(model, "tcp")
    assert {scene.model.geom(int(geom)).name for geom in scene.robot.gripper_geoms} == {"palm", "jaw", "left_tip"}
    travel = measure_gripper(scene)
    assert travel is not None
    assert travel.openings_m[0] > 0.03
