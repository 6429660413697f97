from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.errors import FeelaheadError
from robot_side.arm.limits import ArmLimits
from robot_side.drivers.mujoco.arm import LONGEST_TURN_S, MujocoArm
from robot_side.drivers.mujoco.drives.joint_drives import JointDrives
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import (
    COUPLING,
    MOTORS,
    POSITION_SERVOS,
    SEVERAL,
    VELOCITY_SERVOS,
    planar_arm,
)
from tests.helpers.tool_driver import PERIOD_S, VALID_S, ToolDriver


def perfect_arm(scene: Scene, limits: ArmLimits | None = None) -> MujocoArm:
    joints = len(scene.robot.arm_joints)
    return MujocoArm(scene, Encoder(0.0, 0.0), None if limits is None else limits.of_joints(joints))


@pytest.mark.parametrize(
    "velocity_m_s", [(0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.15), (-0.1, -0.1, 0.05), (0.02, 0.0, 0.0)]
)
def test_the_tool_moves_as_commanded(velocity_m_s: tuple[float, float, float]) -> None:
    driver = ToolDriver.load()
    wanted = np.array(velocity_m_s)
    path = driver.move(np.concatenate([wanted, np.zeros(3)]), 0.8)
    steady = path[round(0.3 / PERIOD_S) :]
    velocity = (steady[-1] - steady[0]) / (PERIOD_S * (len(steady) - 1))
    # 1 % of the speed along and across, over half a second.
    assert np.linalg.norm(velocity - wanted) < 0.01 * np.linalg.norm(wanted)


def test_an_arm_that_nobody_ticks_stops_by_itself() -> None:
    driver = ToolDriver.load()
    path = driver.move(np.array([0.25, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.5)
    speed = float(np.linalg.norm(path[-1] - path[-2]) / PERIOD_S)
    assert speed == pytest.approx(0.25, rel=0.02)
    last = driver.tool_m()
    state = driver.wait(1.0)
    stopped = driver.tool_m()
    assert np.linalg.norm(driver.scene.data.qvel[driver.scene.robot.arm_velocities]) < 1e-3
    assert np.abs(state.joint_velocities_rad_s).max() < 1e-3
    # The rest of the command, then a stop; at 12 rad/s² it takes less than 2 cm from 0.25 m/s.
    assert speed * VALID_S * 0.95 < np.linalg.norm(stopped - last) < speed * VALID_S + 0.02
    driver.wait(1.0)
    assert np.linalg.norm(driver.tool_m() - stopped) < 1e-5


def test_ticking_does_not_change_the_physics() -> None:
    paths = []
    for ticks in (1, 500):
        scene = load_scene()
        arm = perfect_arm(scene)
        arm.state(7.0)
        arm.command(np.array([0.4, -0.2, 0.1, 0.0, 0.3, 0.0]), 7.3)
        for tick in range(1, ticks + 1):
            state = arm.state(7.0 + 0.5 * tick / ticks)
        paths.append(state.joint_positions_rad)
        assert state.time_s == pytest.approx(7.5)
    np.testing.assert_array_equal(paths[0], paths[1])


def test_the_same_instant_is_measured_once_and_the_past_not_at_all() -> None:
    arm = MujocoArm(load_scene(), Encoder(seed=1))
    first = arm.state(3.0)
    assert arm.state(3.0) is first
    assert arm.state(2.0) is first
    later = arm.state(3.001)
    assert later.time_s == pytest.approx(3.001)
    assert arm.state(3.001) is later


def test_a_suspended_process_skips_all_but_two_seconds() -> None:
    scene = load_scene()
    arm = perfect_arm(scene)
    arm.state(0.0)
    arm.command(np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.1)
    before = scene.data.qpos[0]
    state = arm.state(3600.0)
    assert scene.data.time == pytest.approx(2.0)
    assert state.time_s == pytest.approx(3600.0)
    assert scene.data.qpos[0] - before < 0.1
    assert arm.state(3600.5).time_s == pytest.approx(3600.5)
    assert scene.data.time == pytest.approx(2.5)


class SlowMachine:
    """Clock that advances by `step_s` with each reading, as if the machine were too slow for the model."""

    def __init__(self, step_s: float) -> None:
        self.now_s = 50.0
        self._step_s = step_s

    def now(self) -> float:
        self.now_s += self._step_s
        return self.now_s


def test_physics_that_cannot_keep_up_gives_way_and_falls_behind() -> None:
    scene = load_scene()
    arm, machine = perfect_arm(scene), SlowMachine(3e-3)
    arm.give_way(machine)
    arm.state(0.0)
    assert arm.share_of_real_time == 1.0
    arm.command(np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.25)
    for turn in range(1, 11):
        began_s = machine.now_s
        # The measurement is on the caller's clock, and a command expires by that, too.
        assert arm.state(0.1 * turn).time_s == pytest.approx(0.1 * turn)
        assert LONGEST_TURN_S < machine.now_s - began_s < LONGEST_TURN_S + 6e-3
    # 7 steps of 100 in each turn.
    assert scene.data.time == pytest.approx(0.07)
    assert arm.share_of_real_time == pytest.approx(0.07)
    assert arm.take_share_of_real_time() == pytest.approx(0.07)
    moving = arm.state(1.001)
    assert np.abs(moving.joint_velocities_rad_s).max() < 0.05
    assert arm.take_share_of_real_time() == 1.0
    assert arm.take_share_of_real_time() == 1.0
    assert arm.share_of_real_time == pytest.approx(71 / 1001)


def test_a_step_that_is_due_is_done_however_slow_the_machine() -> None:
    scene = load_scene()
    arm = perfect_arm(scene)
    arm.give_way(SlowMachine(1.0))
    arm.state(0.0)
    arm.state(0.01)
    assert scene.data.time == pytest.approx(1e-3)


def test_mujocos_own_last_words_are_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = perfect_arm(load_scene())
    arm.state(0.0)

    def gives_up(*_: object) -> None:
        raise mujoco.FatalError("mj_stackAlloc: out of memory\nincrease <size memory>")

    monkeypatch.setattr(mujoco, "mj_step", gives_up)
    with pytest.raises(FeelaheadError, match="MuJoCo gave up: mj_stackAlloc: out of memory increase <size memory>"):
        arm.state(0.01)


def test_a_blocked_arm_winds_nothing_up(tmp_path: Path) -> None:
    block = '<geom name="block" type="box" pos="0.5 0 -0.15" size="0.15 0.3 0.1"/>'
    key = '<keyframe><key qpos="0.2 -0.2 0 0"/></keyframe>'
    stiff = POSITION_SERVOS.replace('kp="1000" kv="50"', 'kp="8000" kv="400"')
    path = planar_arm(tmp_path, arm_actuators=stiff, world=block, extra_bottom=COUPLING + key)
    scene = load_scene(path, "tcp")
    arm = perfect_arm(scene)
    arm.state(0.0)
    for tick in range(1, 1000):
        arm.command(np.array([0.5, 0.0]), tick * 2e-3 + 0.05)
        state = arm.state(tick * 2e-3)
    assert "block" in {name for _, name in GroundTruth(scene).observe().contacts}
    blocked = state.joint_positions_rad
    pressing = abs(float(scene.data.actuator_force[0]))
    # Halted, it stops pressing and stays where it is.
    released = arm.state(3.0)
    assert np.abs(released.joint_velocities_rad_s).max() < 1e-3
    assert np.abs(released.joint_positions_rad - blocked).max() < 0.02
    assert abs(float(scene.data.actuator_force[0])) < pressing - 10.0
    # Commanded back it moves at once: 1.5 s of pressing at 0.5 rad/s left no 0.75 rad to be unwound.
    arm.command(np.array([-0.5, 0.0]), 4.0)
    assert arm.state(3.2).joint_positions_rad[0] < blocked[0] - 0.06


@pytest.mark.parametrize("actuators", [POSITION_SERVOS, VELOCITY_SERVOS, MOTORS, *SEVERAL])
def test_every_kind_of_actuator_holds_moves_and_stops_an_arm(tmp_path: Path, actuators: str) -> None:
    scene = load_scene(planar_arm(tmp_path, arm_actuators=actuators), "tcp")
    arm = perfect_arm(scene)
    start = arm.state(0.0).joint_positions_rad
    # Gravity pulls on an arm without gravity compensation.
    np.testing.assert_allclose(arm.state(1.0).joint_positions_rad, start, atol=2e-3)
    velocity = np.array([0.4, -0.3])
    positions = []
    for tick in range(500):
        arm.command(velocity, 1.0 + tick * 2e-3 + 0.05)
        positions.append(arm.state(1.0 + tick * 2e-3).joint_positions_rad)
    np.testing.assert_allclose((positions[-1] - positions[200]) / (299 * 2e-3), velocity, rtol=0.02)
    stopped = arm.state(2.5)
    assert np.abs(stopped.joint_velocities_rad_s).max() < 1e-3
    assert np.abs(stopped.joint_positions_rad - positions[-1]).max() < 0.4 * 0.05 + 0.4**2 / 12.0 + 5e-3


def test_motors_overcome_dry_friction(tmp_path: Path) -> None:
    model = planar_arm(tmp_path, arm_actuators=MOTORS)
    model.write_text(model.read_text().replace('armature="0.1"', 'armature="0.001" frictionloss="40"'))
    arm = perfect_arm(load_scene(model, "tcp"))
    arm.state(0.0)
    velocity = np.array([0.3, -0.4])
    arm.command(velocity, 1.0)
    first, last = (arm.state(time_s).joint_positions_rad for time_s in (0.4, 0.8))
    np.testing.assert_allclose((last - first) / 0.4, velocity, rtol=0.05)


def test_a_joint_that_was_pushed_away_does_not_spring_back(tmp_path: Path) -> None:
    scene = load_scene(
        planar_arm(tmp_path, arm_actuators=POSITION_SERVOS.replace("kp", 'forcerange="-60 60" kp')), "tcp"
    )
    arm = perfect_arm(scene)
    start, pushed = arm.state(0.0).joint_positions_rad, scene.data.qfrc_applied[:1]
    fastest = 0.0
    for tick in range(1500):
        arm.command(np.array([0.2, 0.0]), tick * 1e-3 + 0.05)
        pushed[:] = -120.0 if 200 < tick < 500 else 0.0
        state = arm.state(tick * 1e-3)
        if tick == 500:
            assert state.joint_positions_rad[0] < start[0] - 0.3
        if tick > 700:
            fastest = max(fastest, float(state.joint_velocities_rad_s[0]))
    assert fastest < 0.5


def test_an_input_that_nothing_drives_rests(tmp_path: Path) -> None:
    actuators = POSITION_SERVOS + '<damper name="brake" joint="elbow" kv="500" ctrlrange="0 1"/>'
    home = '<keyframe><key name="home" qpos="0.4 -1 0 0" ctrl="0.4 -1 1 0"/></keyframe>'
    scene = load_scene(planar_arm(tmp_path, arm_actuators=actuators, extra_bottom=COUPLING + home), "tcp")
    arm = perfect_arm(scene)
    arm.command(np.array([0.0, 0.5]), 1.0)
    assert arm.state(0.0).time_s == 0.0
    assert arm.state(0.5).joint_velocities_rad_s[1] == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize("kind", ["BADQPOS", "BADQVEL", "BADQACC", "CONTACTFULL", "BADCTRL"])
def test_of_mujocos_warnings_three_say_that_it_is_unstable(kind: str) -> None:
    scene = load_scene()
    arm = perfect_arm(scene)
    arm.state(0.0)
    scene.data.warning[getattr(mujoco.mjtWarning, f"mjWARN_{kind}")].number = 1
    if kind.startswith("BADQ"):
        with pytest.raises(FeelaheadError, match="unstable"):
            arm.state(0.01)
    else:
        arm.state(0.01)


def test_it_grasps_and_lifts_the_target() -> None:
    driver = ToolDriver.load()
    target = driver.scene.data.body("table_scene/target")
    assert driver.arm.state(driver.now_s).gripper_opening_m == pytest.approx(0.085, abs=1e-3)
    driver.go_to(np.array([0.6, 0.0, 0.07]), 1.5)
    driver.go_to(np.array([0.785, 0.0, 0.07]), 2.0)
    assert driver.contacts == set()
    state = driver.grip(1.0, 0.8)
    assert state.gripper_holding
    assert state.gripper_opening_m == pytest.approx(0.04, abs=1e-3)
    driver.go_to(np.array([0.7, 0.0, 0.2]), 3.0)
    assert target.xpos[2] > 0.18
    assert {name for _, name in driver.contacts} == {"target"}
    driver.wait(1.0)
    height_m = target.xpos[2]
    assert driver.wait(60.0).gripper_holding
    assert target.xpos[2] == pytest.approx(height_m, abs=1e-4)
    assert not driver.grip(-1.0, 0.8).gripper_holding
    assert target.xpos[2] < 0.1


def test_weak_servos_and_other_drives_may_lead_farther() -> None:
    stiffness, strongest = np.array([4000.0, 12.5, 50.0, 0.0]), np.array([150.0, 5.0, np.inf, 87.0])
    gear, nothing = np.array([1.0, 2.0, 1.0, 1.0]), np.zeros(4)
    ends, order = np.full(4, np.inf), np.arange(4)
    drives = JointDrives(gear, nothing, nothing, stiffness, nothing, strongest, -ends, ends, joint=order, place=order)
    # An eighth of 5 N m at 2² 12.5 N m/rad is 12.5 mrad.
    np.testing.assert_allclose(drives.windup_rad(0.005), [0.005, 0.0125, 0.02, 0.02])
    np.testing.assert_allclose(load_scene().robot.drives.windup_rad(0.005), 0.005)


def test_a_bad_command_is_named_and_changes_nothing() -> None:
    scene = load_scene()
    arm = perfect_arm(scene)
    arm.state(0.0)
    for velocity in (np.full(6, np.nan), np.full(6, np.inf), np.zeros(5), np.zeros((6, 1))):
        with pytest.raises(ValueError, match="joint_velocity_rad_s"):
            arm.command(velocity, 1.0)
    for closing in (1.1, -1.1, np.nan):
        with pytest.raises(ValueError, match="closing"):
            arm.command_gripper(closing, 1.0)
    for until_s in (np.nan, np.inf):
        with pytest.raises(ValueError, match="valid_until_s"):
            arm.command(np.full(6, 0.5), until_s)
        with pytest.raises(ValueError, match="valid_until_s"):
            arm.command_gripper(1.0, until_s)
    arm.state(0.01)
    before = scene.data.ctrl.copy()
    arm.state(0.5)
    np.testing.assert_allclose(scene.data.ctrl, before, atol=1e-3)


SECOND_ARM = """
  <body name="second" pos="0 1 0.5"><joint name="idle" axis="0 1 0" armature="0.01"/>
    <geom name="second_link" type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="2"/></body>
"""


@pytest.mark.parametrize(
    "actuator",
    [
        '<position name="idle" joint="idle" kp="300" kv="20"/>',
        '<velocity name="idle" joint="idle" kv="20"/>',
        '<motor name="idle" joint="idle" gear="5"/>',
    ],
    ids=["position", "velocity", "motor"],
)
def test_joints_that_are_neither_arm_nor_fingers_are_held(tmp_path: Path, actuator: str) -> None:
    home = '<keyframe><key name="home" qpos="0 0.4 -1 0 0"/></keyframe>'
    model = planar_arm(
        tmp_path, arm_actuators=POSITION_SERVOS + actuator, world=SECOND_ARM, extra_bottom=COUPLING + home
    )
    scene = load_scene(model, "tcp")
    joint = scene.data.joint("idle")
    joint.qpos[0] = 0.7
    arm = perfect_arm(scene)
    for tick in range(1000):
        arm.state(1e-3 * tick)
    assert abs(joint.qpos[0] - 0.7) < 0.005
    assert scene.never_held >= {"second"}
