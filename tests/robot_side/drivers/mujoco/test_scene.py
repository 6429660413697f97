import math
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.errors import ConfigurationError
from common.roles import Role
from robot_side.drivers.mujoco import model_enums
from robot_side.drivers.mujoco.camera import MujocoCamera
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from tests.helpers.arm_models import MOTORS, POSITION_SERVOS, SHAPES, STONE, TENDON_GRIPPER, planar_arm


def test_the_numbers_of_the_kinds_are_mujocos() -> None:
    names = {
        model_enums.JointKind: (mujoco.mjtJoint, "mjJNT_"),
        model_enums.GeomKind: (mujoco.mjtGeom, "mjGEOM_"),
        model_enums.TransmissionKind: (mujoco.mjtTrn, "mjTRN_"),
        model_enums.WrappedKind: (mujoco.mjtWrap, "mjWRAP_"),
        model_enums.GainKind: (mujoco.mjtGain, "mjGAIN_"),
        model_enums.BiasKind: (mujoco.mjtBias, "mjBIAS_"),
        model_enums.DynamicsKind: (mujoco.mjtDyn, "mjDYN_"),
    }
    for kinds, (theirs, prefix) in names.items():
        for kind in kinds:
            assert int(getattr(theirs, prefix + kind.name.replace("_", ""))) == kind


def test_the_built_in_arm_has_the_published_dimensions(built_in: Scene) -> None:
    data = mujoco.MjData(built_in.model)
    random = np.random.default_rng(1)
    flange_to_tool = 0.145
    for _ in range(20):
        angles = random.uniform(-3.0, 3.0, 6)
        data.qpos[built_in.robot.arm_positions] = angles
        mujoco.mj_kinematics(built_in.model, data)
        # Standard Denavit-Hartenberg parameters of the UR5e (d, a, alpha), the base turned by half a turn.
        pose = np.diag([-1.0, -1.0, 1.0, 1.0])
        rows = [(0.1625, 0, 1), (0, -0.425, 0), (0, -0.3922, 0), (0.1333, 0, 1), (0.0997, 0, -1), (0.0996, 0, 0)]
        for angle, (d, a, quarter_turns) in zip(angles, rows, strict=True):
            c, s, k = math.cos(angle), math.sin(angle), quarter_turns
            turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])
            tilt = np.array([[1, 0, 0, a], [0, 1 - abs(k), -k, 0], [0, k, 1 - abs(k), 0], [0, 0, 0, 1]])
            pose = pose @ turn @ tilt
        tool = pose @ np.array([0.0, 0.0, flange_to_tool, 1.0])
        np.testing.assert_allclose(data.site_xpos[built_in.robot.site], tool[:3], atol=1e-6)


def test_objects_and_roles_come_from_names(shapes: Scene) -> None:
    anonymous = next(name for name in shapes.roles if name.startswith("geom"))
    assert shapes.roles == {
        "wall": Role.OBSTACLE,
        "table_slab": Role.SUPPORT,
        anonymous: Role.OBSTACLE,
        "post": Role.OBSTACLE,
        "Target_egg": Role.TARGET,
        "stone": Role.OBSTACLE,
    }
    assert set(shapes.primitives.volume_errors) == {"post"}
    post = next(thing for thing in shapes.objects if thing.name == "post")
    assert len(post.geoms) == 3


def test_roles_can_be_overridden_and_ignored_objects_have_no_primitives(tmp_path: Path) -> None:
    path = planar_arm(tmp_path, world=SHAPES, extra_top=STONE)
    scene = load_scene(path, "tcp", {"wall": Role.IGNORED, "post": Role.TARGET})
    seen = MujocoCamera(scene).perceive(0.0)
    assert scene.roles["post"] is Role.TARGET
    assert seen.roles[seen.names.index("wall")] is Role.IGNORED
    assert len(seen.half_space_object) == 0
    with pytest.raises(ConfigurationError, match="no object 'vase'; valid: wall, table_slab"):
        load_scene(path, "tcp", {"vase": Role.TARGET})


def test_contacts_name_the_gripper_geom_and_the_object_supports_included(built_in: Scene) -> None:
    model, data = built_in.model, built_in.data
    target = int(model.body("table_scene/target").jntadr[0])
    address = int(model.jnt_qposadr[target])
    data.qpos[address : address + 3] = data.geom("left_fingertip").xpos
    table = model.body("table_scene/table").id
    model.body_pos[table, 2] = data.geom("palm").xpos[2]
    # With sleep enabled, MuJoCo reads the places of fixed geoms only once.
    model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    mujoco.mj_forward(model, data)
    contacts = GroundTruth(built_in).observe().contacts
    assert ("left_fingertip", "target") in contacts
    assert ("palm", "table") in contacts
    assert {name for _, name in contacts} <= set(built_in.roles)


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0])
def test_a_bare_robot_gets_the_table_where_its_tool_is(tmp_path: Path, yaw_deg: float) -> None:
    floor = '<geom name="floor" type="plane" size="2 2 0.1"/>'
    key = '<keyframe><key qpos="0.1 -0.2 0.01 0.01"/></keyframe>'
    path = planar_arm(tmp_path, world=floor, base="1 2 0.1", yaw_deg=yaw_deg, extra_bottom=key)
    scene = load_scene(path, "tcp")
    assert scene.warnings == ()
    assert scene.roles["target"] is Role.TARGET
    assert list(scene.roles).count("floor") == 1
    tool, target = scene.data.site_xpos[scene.robot.site], scene.data.body("table_scene/target").xpos
    ahead = np.array([math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))])
    np.testing.assert_allclose(target[:2] - tool[:2], 0.23 * ahead, atol=1e-6)
    half_height = scene.model.geom("table_scene/target").size[2]
    np.testing.assert_allclose(target[2], 0.1 + half_height, atol=1e-6)
    # Attaching kept the configuration.
    np.testing.assert_allclose(scene.data.qpos[scene.robot.arm_positions], [0.1, -0.2])


def test_mujocos_warnings_leave_no_file_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    scene = load_scene()
    scene.data.qvel[0] = np.nan
    mujoco.mj_step(scene.model, scene.data)
    assert scene.data.warning[mujoco.mjtWarning.mjWARN_BADQVEL].number == 1
    assert list(tmp_path.iterdir()) == []


def test_a_gripper_without_other_bodies_is_the_last_link(tmp_path: Path) -> None:
    stick = """<mujoco><worldbody><body name="link"><joint name="j" axis="0 0 1"/>
      <geom name="stick" type="box" size="0.1 0.01 0.01"/><site name="end" pos="0.1 0 0"/></body></worldbody>
      <actuator><motor joint="j"/></actuator></mujoco>"""
    (tmp_path / "stick.xml").write_text(stick)
    scene = load_scene(tmp_path / "stick.xml", "end")
    assert [scene.model.geom(int(geom)).name for geom in scene.robot.gripper_geoms] == ["stick"]
    assert scene.robot.gripper_actuators.size == 0
    assert not scene.robot.geom_on_finger.any()


def test_the_gripper_is_found_beyond_the_last_arm_link(tmp_path: Path) -> None:
    scene = load_scene(planar_arm(tmp_path, gripper_actuators=TENDON_GRIPPER), "camera_mount")
    names = [scene.model.geom(int(geom)).name for geom in scene.robot.gripper_geoms]
    assert names == ["palm", "left_tip", "right_tip"]
    np.testing.assert_array_equal(scene.robot.geom_on_finger, [False, True, True])
    assert [scene.model.actuator(int(index)).name for index in scene.robot.gripper_actuators] == ["hand"]


KEYS = '<keyframe><key name="{first}" qpos="0.1 -0.2 0.01 0.01"/><key name="{second}" qpos="0 0 0 0"/></keyframe>'


@pytest.mark.parametrize(
    ("extra_bottom", "said"),
    [
        (KEYS.format(first="rest", second="home"), "the keyframe 'home'"),
        (KEYS.format(first="rest", second="up"), "the first keyframe, 'rest' ("),
        ("", "the middle of the joints' ranges, as the model has no keyframe ("),
    ],
)
def test_the_start_pose_is_said(tmp_path: Path, extra_bottom: str, said: str) -> None:
    model = planar_arm(tmp_path, extra_bottom=extra_bottom)
    assert load_scene(model, "tcp").start_pose.startswith(said)
    notes = build_parts(RobotSettings(model=model, site="tcp"), 1, "clock").notes
    assert notes[0].startswith(f"the arm starts at {said}")
    assert notes[1].startswith("objects: target: target; obstacle: ")


def test_a_scene_without_a_target_says_how_to_name_one(tmp_path: Path) -> None:
    world = '<geom name="tin" type="sphere" size="0.1" pos="1 1 0"/><geom name="table" type="sphere" size="0.1"/>'
    model = planar_arm(tmp_path, world=world)
    notes = build_parts(RobotSettings(model=model, site="tcp"), 1, "clock").notes
    assert notes[1] == "objects: obstacle: tin; support: table"
    assert "no object is a target" in notes[2]
    assert '[roles] NAME = "target"' in notes[2]
    settings = RobotSettings(model=model, site="tcp", roles={"tin": Role.TARGET})
    notes = build_parts(settings, 1, "clock").notes
    assert notes[1] == "objects: target: tin; support: table"
    assert not any("no object is a target" in note for note in notes)


def test_a_body_and_a_geom_of_one_name_are_one_object_and_that_is_said(tmp_path: Path) -> None:
    world = (
        '<geom name="target" type="sphere" size="0.1" pos="1 1 0"/>'
        '<body name="target" pos="1 0 0"><geom type="sphere" size="0.1"/></body>'
    )
    model = planar_arm(tmp_path, world=world)
    assert load_scene(model, "tcp").shared_names == ("target",)
    notes = build_parts(RobotSettings(model=model, site="tcp"), 1, "clock").notes
    assert notes[2].startswith("'target' names several things")
    assert load_scene().shared_names == ()


NO_BASE = """<mujoco><worldbody>{more}<body name="arm">{joint}<geom size="0.1"/><site name="end"/>
<body><joint name="other"/><geom size="0.1"/></body></body></worldbody>
<actuator><motor joint="other"/></actuator></mujoco>"""
BALL_JOINT = '<body pos="0.3 0 0"><joint name="b" type="ball"/><geom size="0.01"/><site name="end"/></body>'
MUSCLE = POSITION_SERVOS.split("/>")[0] + '/><muscle name="pull" joint="elbow" lengthrange="0 1"/>'
STRING = (
    '<tendon><fixed name="string"><joint joint="shoulder" coef="1"/><joint joint="elbow" coef="1"/></fixed></tendon>'
)
STRINGS = '<position name="winch" tendon="string" kp="10"/>'
OFF = POSITION_SERVOS.replace('joint="elbow"', 'group="3" joint="elbow"')
KEY = '<keyframe><key name="home" qpos="{} 0 0 0" qvel="0 0 0 {}"/></keyframe>'
# Enough memory to compile it, too little for its contacts.
HEAP = "".join(f'<body pos="1 {0.01 * ball} 2"><freejoint/><geom size="0.05"/></body>' for ball in range(40))
REFUSED: list[tuple[dict[str, str] | str, str | None, str]] = [
    ("<mujoco", "tcp", "valid: an MJCF file that MuJoCo compiles"),
    ({}, "tool", "valid: tcp, camera_mount"),
    ({}, None, "none is given; valid: tcp, camera_mount"),
    ({"arm_actuators": "", "gripper_actuators": ""}, "tcp", "no actuators"),
    ({"arm_actuators": MOTORS.split("/>")[0] + "/>"}, "tcp", "arm's joint 'elbow' has no actuator of its own: nothing"),
    ({"arm_actuators": MUSCLE}, "tcp", "'pull' of joint 'elbow' is of an unsupported kind; valid: position"),
    (
        {"arm_actuators": POSITION_SERVOS + MUSCLE[-55:]},
        "tcp",
        "'pull' of joint 'elbow' is of an unsupported kind, beside",
    ),
    (
        {"arm_actuators": POSITION_SERVOS + STRINGS, "extra_bottom": STRING},
        "tcp",
        "acts by a tendon on a joint that the actuator 'shoulder' drives",
    ),
    (
        {"arm_actuators": OFF, "extra_top": '<option actuatorgroupdisable="3"/>'},
        "tcp",
        "'elbow' has no actuator of its own: the model disables",
    ),
    ({"world": '<site name="corner"/>'}, "corner", "no joint moves 'corner'"),
    (
        {"world": '<body mocap="true"><geom size="1"/><site name="grip"/></body>'},
        "grip",
        "no joint moves 'grip': a mocap body carries it",
    ),
    ({"wrist": BALL_JOINT}, "end", "joint 'b' is ball: no single motor moves such a joint; valid: hinge or slide"),
    (NO_BASE.format(joint="<freejoint/>", more=""), "end", "of body 'arm' is free: the robot's base must stand fixed"),
    (
        NO_BASE.format(joint="<joint/>", more='<body mocap="true"/>'),
        "end",
        "of its own: the model is moved by a mocap",
    ),
    ({"extra_top": '<option timestep="1e-6"/>'}, "tcp", "timestep = 1e-06; valid: 1e-05 to 0.02 s"),
    ({"extra_top": '<option timestep="0.2"/>'}, "tcp", "timestep = 0.2; valid: 1e-05 to 0.02 s"),
    ({"extra_top": '<size memory="50K"/>', "world": HEAP}, "tcp", "MuJoCo cannot simulate it: "),
    ({"extra_bottom": KEY.format("nan", "0")}, "tcp", "keyframe 'home' holds NaN or infinity; valid: finite qpos"),
    ({"extra_bottom": KEY.format("0", "inf")}, "tcp", "keyframe 'home' holds NaN or infinity; valid: finite qvel"),
    ({"world": '<geom name="post" size="0.1" pos="nan 0 0"/>'}, "tcp", "post"),
    ({"extra_top": '<option gravity="nan 0 0"/>'}, "tcp", "at its start its joints accelerate without bound"),
    ({"arm_actuators": MUSCLE.replace('name="pull" ', "")}, "tcp", "the actuator 1 of joint 'elbow' is of"),
]


@pytest.mark.parametrize(("model", "site", "said"), REFUSED)
def test_what_cannot_be_used_is_told_in_one_line(
    tmp_path: Path, model: dict[str, str] | str, site: str | None, said: str
) -> None:
    path = tmp_path / "arm.xml"
    if isinstance(model, str):
        path.write_text(model)
    else:
        planar_arm(tmp_path, **model)  # type: ignore[arg-type]
    with pytest.raises(ConfigurationError) as caught:
        load_scene(path, site)
    assert said in str(caught.value)
    assert "valid: " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_a_keyframe_sets_in_motion_moves_and_the_robot_rests(tmp_path: Path) -> None:
    mover = '<body pos="0.9 0 0.2"><joint name="mover" type="slide"/><geom size="0.02"/></body>'
    key = '<keyframe><key name="home" qpos="0.05 0 0 0 0" qvel="-0.5 0.3 0.1 0 0"/></keyframe>'
    post = '<geom name="post" size="0.1" pos="2 0 0"/>'
    scene = load_scene(planar_arm(tmp_path, world=mover + post, extra_bottom=key), "tcp")
    np.testing.assert_array_equal(scene.data.qvel, [-0.5, 0.0, 0.0, 0.0, 0.0])
    assert scene.fixed == {"post"}
    assert load_scene().fixed == {"floor", "table"}


# An arm's identity: its joints, links and limits, independent of its place and surroundings.


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ('<body name="base" pos="0 0 0" euler="0 0 0.0">', '<body name="base" pos="1 2 0" euler="0 0 30">', True),
        ('kp="1000"', 'kp="900"', True),
        ('range="-170 170"', 'range="-160 170"', False),
        ('<body name="lower" pos="0.3 0 0">', '<body name="lower" pos="0.31 0 0">', False),
        ('<joint name="elbow" axis="0 1 0"', '<joint name="elbow" axis="0 0.1 1"', False),
        ('<joint name="elbow" axis', '<joint name="elbow" pos="0 0.01 0" axis', False),
        ('<site name="tcp" pos="0 0 0.08"/>', '<site name="tcp" pos="0 0 0.09"/>', False),
    ],
    ids=["stands elsewhere", "other servos", "a limit", "a link", "an axis", "where it turns", "the tool"],
)
def test_another_limit_link_axis_or_tool_makes_another_arm(old: str, new: str, same: bool, tmp_path: Path) -> None:
    file = planar_arm(tmp_path)
    plain, text = load_scene(file, "tcp").robot.fingerprint, file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    assert (load_scene(file, "tcp").robot.fingerprint == plain) is same
