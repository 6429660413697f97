"""A robot that a person brings: where the table stands, what the hand can hold, and what the start says."""

from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from robot_side.arm.limits import ArmLimits
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.brought.table import fit_target
from robot_side.drivers.mujoco.checks.cost import cost_findings
from robot_side.drivers.mujoco.checks.following import following_findings
from robot_side.drivers.mujoco.checks.joints import joint_findings
from robot_side.drivers.mujoco.checks.reach import reach_findings
from robot_side.drivers.mujoco.checks.site_axis import site_findings
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.gripper_measurement import measure_gripper
from robot_side.drivers.mujoco.robot_model import SiteAxis
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import TENDON_GRIPPER, planar_arm
from tests.robot_side.drivers.mujoco.test_arm import SlowMachine

ASSETS = Path(load_scene.__code__.co_filename).parent / "assets"
SECOND_ARM = """<body name="second" pos="0 1 0"><joint name="other"/><geom size="0.05"/></body></worldbody>"""


def brought(folder: Path, *changes: tuple[str, str]) -> Path:
    """Write the built-in arm as a model of one's own, with the texts replaced; return its path."""
    text = (ASSETS / "arm.xml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "arm.xml"
    path.write_text(text)
    return path


def no_keyframe() -> tuple[str, str]:
    text = (ASSETS / "arm.xml").read_text()
    return text[text.index("<keyframe>") : text.index("</mujoco>")], ""


def joint_lines(scene: Scene) -> list[str]:
    return joint_findings(scene, measure_gripper(scene))


def test_the_built_in_arm_as_a_model_of_ones_own_stands_as_ever_and_nothing_is_said(tmp_path: Path) -> None:
    own, built_in = load_scene(brought(tmp_path), "tool"), load_scene()
    assert own.data.body("table_scene/table").xpos == pytest.approx(built_in.data.body("table_scene/table").xpos)
    assert reach_findings(own) + joint_lines(own) == []


def test_without_a_keyframe_a_start_is_found_from_which_the_target_is_in_reach(tmp_path: Path) -> None:
    # In the middle of this range the tool points up.
    upwards = ('<joint name="wrist_2"/>', '<joint name="wrist_2" range="0 3.1416"/>')
    scene = load_scene(brought(tmp_path, no_keyframe(), upwards), "tool")
    assert "searched for" in scene.start_pose
    assert reach_findings(scene) == []
    again = load_scene(brought(tmp_path, no_keyframe(), upwards), "tool")
    assert (again.data.qpos == scene.data.qpos).all()


@pytest.mark.parametrize("place", ["0 0 0.045", "0 0 0.245", "0 0.04 0.145"])
def test_a_site_far_from_the_fingertips_is_moved_between_them(tmp_path: Path, place: str) -> None:
    own, built_in = load_scene(brought(tmp_path, ('pos="0 0 0.145"', f'pos="{place}"')), "tool"), load_scene()
    tool_m, expected_m = (scene.data.site_xpos[scene.robot.site] for scene in (own, built_in))
    assert tool_m == pytest.approx(expected_m, abs=2e-3)
    assert "from the site 'tool', between the fingertips" in own.start_pose


def test_where_only_one_jaw_moves_the_tool_is_near_the_other_one_and_the_target_is_low(tmp_path: Path) -> None:
    one_jaw = (
        ('<joint name="right_finger" axis="0 -1 0"/>', ""),
        ('<joint joint="right_finger" coef="1"/>', ""),
        ('<joint joint1="left_finger" joint2="right_finger" solimp="0.95 0.99 0.001" solref="0.005 1"/>', ""),
        ('<body name="right_finger" pos="0 0 0.08"', '<body name="right_finger" pos="0 -0.0425 0.08"'),
        (" 0.0425 0.0425", " 0.0425"),
        ('pos="0 0 0.145"', 'pos="0 0 0.045"'),
    )
    scene = load_scene(brought(tmp_path, *one_jaw), "tool")
    still = scene.data.geom("right_fingertip")
    away_m = still.xmat.reshape(3, 3)[:, 1] @ (scene.data.site_xpos[scene.robot.site] - still.xpos)
    assert away_m == pytest.approx(0.006 + 0.033, abs=1e-3)
    assert scene.model.geom("table_scene/target").size[2] == pytest.approx(0.03)


def turning_jaw(folder: Path) -> Path:
    """Write the built-in arm with one jaw that turns by a quarter, about a hinge 50 mm behind its tip."""
    return brought(
        folder,
        ('name="left_finger" axis="0 1 0"', 'name="left_finger" type="hinge" pos="0 0 0.03" axis="-1 0 0"'),
        ('<geom name="left_finger" pos="0 0.007 0.02" size="0.011 0.007 0.02" mass="0.04"/>', ""),
        ('<joint name="right_finger" axis="0 -1 0"/>', ""),
        ('<joint joint="right_finger" coef="1"/>', ""),
        ('<joint joint1="left_finger" joint2="right_finger" solimp="0.95 0.99 0.001" solref="0.005 1"/>', ""),
        ('range="0 0.0425"', 'range="0 1.5708"'),
        ('kp="2000" kv="40" forcerange="-40 40" ctrlrange="0 0.085"', 'kp="20" kv="1" ctrlrange="0 1.5708"'),
        (" 0.0425 0.0425", " 1.5708"),
        (" 0.085", " 1.5708"),
    )


def test_a_jaw_that_turns_pushes_the_target_across_and_does_not_overturn_it(tmp_path: Path) -> None:
    scene = load_scene(turning_jaw(tmp_path), "tool")
    still = scene.data.geom("right_fingertip")
    away_m = still.xmat.reshape(3, 3)[:, 1] @ (scene.data.site_xpos[scene.robot.site] - still.xpos)
    # 25 mm from the still jaw's face, 10 mm behind the tool's point, is the jaw's face when it has 45 degrees left.
    near_m = away_m - 0.006
    assert near_m == pytest.approx(0.5 * (0.025 + 0.013), abs=1e-3)
    # On the table the target slides rather than tips over.
    [friction] = scene.model.pair_friction
    assert friction[0] == pytest.approx(0.3)


@pytest.mark.parametrize("axis", ["x", "-z"])
def test_a_wrong_axis_is_named_of_a_hand_with_one_turning_jaw(axis: SiteAxis, tmp_path: Path) -> None:
    scene = load_scene(turning_jaw(tmp_path), "tool", site_axis=axis)
    [line] = site_findings(scene, axis, measure_gripper(scene))
    assert "--site-axis z fits" in line


@pytest.mark.parametrize(("own", "kept"), [('cone="elliptic" impratio="10"', 10.0), ("", 30.0)])
def test_only_a_model_that_chooses_no_contacts_gets_others_at_the_table(tmp_path: Path, own: str, kept: float) -> None:
    scene = load_scene(brought(tmp_path, ('cone="elliptic" impratio="10" noslip_iterations="1"', own)), "tool")
    assert scene.model.opt.impratio == kept
    assert scene.model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC


def test_fingers_that_would_close_up_and_down_get_another_start(tmp_path: Path) -> None:
    # Without a keyframe, this wrist starts with one finger above the other.
    wrist = ('<joint name="wrist_3"/>', '<joint name="wrist_3" range="-1.5708 4.7124"/>')
    scene = load_scene(brought(tmp_path, no_keyframe(), wrist), "tool")
    across = scene.data.site_xmat[scene.robot.site].reshape(3, 3)[:, 0]
    assert abs(across[2]) < 0.3


def test_a_second_arm_is_no_surroundings(tmp_path: Path) -> None:
    motor = '<actuator>\n    <motor name="other" joint="other"/>'
    changes = (no_keyframe(), ("</worldbody>", SECOND_ARM), ("<actuator>", motor))
    assert "target" in load_scene(brought(tmp_path, *changes), "tool").roles


@pytest.mark.parametrize("thick_m", [0.014, 0.034, 0.12])
def test_the_target_is_so_thin_that_the_fingers_span_it(thick_m: float) -> None:
    table = mujoco.MjSpec.from_file(str(ASSETS / "table_scene.xml"))
    before = list(table.geom("target").size)
    fit_target(table, thick_m)
    length_m, width_m, height_m = table.geom("target").size
    assert max(length_m, width_m) <= 0.5 * thick_m + 1e-12
    assert table.body("target").pos[2] == pytest.approx(height_m)
    assert (list(table.geom("target").size) == before) == (thick_m > 0.063)
    fit_target(table, 0.04, lean=0.1)
    assert max(table.geom("target").size[:2]) == pytest.approx(0.02 - 0.1 * 0.06)


def test_a_start_out_of_reach_is_said(tmp_path: Path) -> None:
    stiff = ('name="elbow" range="-3.1416 3.1416"', 'name="elbow" range="2.37 2.38"')
    [line] = reach_findings(load_scene(brought(tmp_path, stiff), "tool"))
    assert "'target' is out of reach" in line


def test_joints_that_do_not_move_as_expected_are_named(tmp_path: Path) -> None:
    dead = ('ctrlrange="-3.1416 3.1416"', 'ctrlrange="-2.9 2.9"')
    [line] = joint_lines(load_scene(brought(tmp_path, dead), "tool"))
    assert line.startswith("joints elbow: turn farther than")


FOLLOWED = '<position name="wrist_3" joint="wrist_3" class="arm_small"/>'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (FOLLOWED, FOLLOWED, None),
        (FOLLOWED, FOLLOWED + '<velocity joint="wrist_3" kv="50"/>', None),
        (FOLLOWED, FOLLOWED.replace("class", 'forcerange="-0.01 0.01" class'), "joint 6 (wrist_3) does not move"),
        ('<joint name="wrist_1"/>', '<joint name="wrist_1" damping="500"/>', "joint 4 (wrist_1) does not move"),
        ('<joint name="elbow"', '<joint name="elbow" armature="900"', "joint 3 (elbow) does not move"),
    ],
)
def test_joints_that_do_not_follow_when_they_are_tried_are_named(
    old: str, new: str, said: str | None, tmp_path: Path
) -> None:
    scene = load_scene(brought(tmp_path, (old, new)), "tool")
    arm = MujocoArm(scene, Encoder(0.0, 0.0))
    before = scene.data.qpos.copy(), scene.data.ctrl.copy()
    lines = following_findings(scene, arm, ArmLimits().of_joints(arm.joint_count, *arm.ends_rad))
    assert [line.partition(": ")[2] for line in lines] == [said] * (said is not None)
    assert arm.state(5.0).simulated_s == scene.data.time == 0.0
    assert not scene.data.qvel.any()
    for now, then in zip((scene.data.qpos, scene.data.ctrl), before, strict=True):
        np.testing.assert_array_equal(now, then)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [('qpos="-0.45168', 'qpos="-9.4', "shoulder_pan"), ("0.0425 0.0425", "5 5", "left_finger, right_finger")],
)
def test_joints_that_start_outside_their_ranges_are_named(old: str, new: str, said: str, tmp_path: Path) -> None:
    lines = joint_lines(load_scene(brought(tmp_path, (old, new)), "tool"))
    assert lines[0] == f"joints {said}: start outside their ranges"
    assert not any("at an end" in line for line in lines)


@pytest.mark.parametrize(("most", "said"), [("100", False), ("5", True)])
def test_motors_too_weak_to_hold_the_start_are_named(most: str, said: bool, tmp_path: Path) -> None:
    servo = '<position name="shoulder_lift" joint="shoulder_lift" class="arm_large"/>'
    motor = f'<motor name="shoulder_lift" joint="shoulder_lift" ctrlrange="-{most} {most}"/>'
    lines = joint_lines(load_scene(brought(tmp_path, (servo, motor), (' gravcomp="1"', "")), "tool"))
    assert any("joints shoulder_lift (5.0 of " in line and "too weak" in line for line in lines) is said


def test_a_hand_without_driven_fingers_is_said(tmp_path: Path) -> None:
    bare = planar_arm(tmp_path, gripper_actuators="")
    assert any("no actuator opens and closes" in line for line in joint_lines(load_scene(bare, "tcp")))
    idle = planar_arm(tmp_path, gripper_actuators=TENDON_GRIPPER.replace("0 255", "0 0.1"))
    assert any("the hand's actuators do not bring" in line for line in joint_lines(load_scene(idle, "tcp")))
    idle.write_text(idle.read_text().replace('size="0.02 0.06 0.02"', 'size="0.02 0.06 0.09"'))
    assert any("_tip' is" in line and "inside 'palm'" in line for line in joint_lines(load_scene(idle, "tcp")))


def test_fingers_that_do_not_close_on_the_target_are_said(tmp_path: Path) -> None:
    barely = ('ctrlrange="0 0.085"', 'ctrlrange="0.06 0.085"')
    [line] = joint_lines(load_scene(brought(tmp_path, barely), "tool"))
    assert line.startswith("the fingers close from 85 to 60 mm only")


@pytest.mark.parametrize(("reading_s", "said"), [(0.004, 1), (0.0, 0)])
def test_physics_that_is_slower_than_real_time_is_said(reading_s: float, said: int) -> None:
    lines = cost_findings(load_scene(), SlowMachine(reading_s))
    assert len(lines) == said
    assert not said or "4.0 ms for each step of 1 ms" in lines[0]


def test_loads_are_those_behind_the_joints_dry_friction(tmp_path: Path) -> None:
    loads_nm = {}
    for rubs in ("", 'frictionloss="8" '):
        axis = ("<joint axis", f"<joint {rubs}axis")
        arm = MujocoArm(load_scene(brought(tmp_path, axis), "tool"), Encoder(0.0, 0.0))
        arm.state(0.0)
        arm.command(np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0]), 1.0)
        loads_nm[rubs] = arm.state(0.5).joint_loads_nm
    free, rubbing = loads_nm.values()
    assert free is not None
    assert rubbing is not None
    assert np.abs(rubbing - free).max() < 0.5
