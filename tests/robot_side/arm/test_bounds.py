"""A workspace, a greatest speed and boxes to keep out of: motion keeps the first two, and all are felt as obstacles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.command.command_line import load_toml
from common.errors import ConfigurationError
from common.protocol.messages import Header, MotionCommand
from common.roles import Role
from robot_side.arm.bounds import Bounds, KeepOut, Workspace
from robot_side.arm.commanded import commanded
from robot_side.arm.limits import ArmLimits
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.surroundings.fixed_objects import WithFixed, fixed_objects, joined
from tests.robot_side.session_bench import QUICK, Bench

LIMITS = ArmLimits().of_joints(6)
BOX = Workspace((0.0, -1.0, 0.1), (1.0, 1.0, 0.9))
coordinate = st.floats(-2.0, 2.0)
vector = st.tuples(coordinate, coordinate, coordinate)


@given(vector, vector, st.floats(0.01, 1.0))
def test_no_step_leads_out_of_the_workspace_and_none_is_too_fast(
    velocity: tuple[float, ...], place: tuple[float, ...], fastest: float
) -> None:
    asked, position = np.array(velocity), np.array(place)
    kept = Bounds(BOX, fastest).kept(asked, position, LIMITS)
    assert np.linalg.norm(kept) <= fastest + 1e-9
    lower, upper = np.array(BOX.lower_m), np.array(BOX.upper_m)
    after = position + 0.02 * kept
    assert (after <= np.maximum(position, upper) + 1e-12).all()
    assert (after >= np.minimum(position, lower) - 1e-12).all()
    share = Bounds(BOX, fastest).share(asked, position, LIMITS)
    assert 0.0 <= share <= 1.0
    np.testing.assert_array_less(np.abs(share * asked), np.abs(kept) + 1e-9)


def test_inside_and_slow_nothing_changes() -> None:
    asked = np.array([0.05, -0.02, 0.01])
    np.testing.assert_array_equal(Bounds(BOX, 0.2).kept(asked, np.array([0.5, 0.0, 0.5]), LIMITS), asked)
    np.testing.assert_array_equal(Bounds().kept(asked, np.full(3, 9.0), LIMITS), asked)


def test_the_tool_comes_up_to_a_side_and_stays_within() -> None:
    """The side is felt, too; here its stiffness is not, as the trigger is held."""
    pose = build_parts(QUICK, 1, "clock")
    tool = pose.kinematics.pose(pose.arm.state(0.0))
    ahead = tool.tool_rotation[:, 2]
    axis = int(np.abs(ahead).argmax())
    lower, upper = np.full(3, -2.0), np.full(3, 2.0)
    side = tool.tool_position_m[axis] + np.sign(ahead[axis]) * 0.06
    (upper if ahead[axis] > 0.0 else lower)[axis] = side
    workspace = Workspace(tuple(lower.tolist()), tuple(upper.tolist()))
    bench = Bench(replace(QUICK, arm_workspace=workspace))
    operator = bench.join(2)
    bench.arm_it(operator)
    bench.drive(3.0, operator, r2=0.6)
    assert bench.robot.newest is not None
    situation, hindrance = bench.robot.newest[1], bench.robot.motion.hindrance.text
    assert hindrance == "at a bound of the workspace, or of speed"
    moved = situation.pose.tool_position_m[axis] - tool.tool_position_m[axis]
    assert 0.05 < np.sign(ahead[axis]) * moved < 0.0605
    assert any(name.startswith("workspace ") for name in situation.objects.names)
    assert bench.robot.newest[0].r2.fast_m[-1] < 0.06


@settings(max_examples=5)
@given(st.integers(0, 2))
def test_fixed_objects_stand_behind_a_frames_own(boxes: int) -> None:
    parts = build_parts(QUICK, 1, "clock")
    fixed = fixed_objects((BOX.lower_m, BOX.upper_m), [KeepOut((0.5, 0.3, 0.2), (0.1, 0.1, 0.2))] * boxes)
    frame = parts.camera.perceive(0.0)
    both = joined(frame, fixed)
    assert both.names == (*frame.names, *fixed.names)
    assert set(both.roles[len(frame.names) :]) == {Role.OBSTACLE}
    assert (both.half_space_object[-6:] >= len(frame.names)).all()
    assert len(both.box_object) == len(frame.box_object) + boxes
    # Outside is solid, inside is free.
    inside = fixed.half_space_normals @ np.array([0.5, 0.0, 0.5])
    assert (inside > fixed.half_space_offsets_m).all()
    source = WithFixed(parts.camera, fixed)
    assert source.perceive(0.0) is source.perceive(0.0)
    source.set_role("workspace +x", Role.TARGET)
    assert source.perceive(0.0).roles == both.roles
    # A camera may use the same names.
    assert len(set(joined(both, fixed).names)) == len(both.names) + len(fixed.names)


def test_no_button_makes_a_fixed_object_the_target() -> None:
    boxes = (KeepOut((0.55, 0.0, 0.4), (0.02, 0.02, 0.02)), KeepOut((0.6, 0.0, 0.3), (0.02, 0.02, 0.02)))
    bench = Bench(replace(QUICK, arm_workspace=Workspace((-2.0, -2.0, -1.0), (2.0, 2.0, 2.0)), arm_keep_out=boxes))
    operator = bench.join(2)
    chosen = set[object]()
    for _ in range(12):
        bench.drive(0.02, operator, next_target=True)
        bench.drive(0.02, operator)
        chosen.add(bench.robot.status(bench.now_s).target)
    assert len(chosen) > 2
    assert not [name for name in chosen if str(name).startswith(("keep out", "workspace"))]


def test_an_arm_that_cannot_move_as_asked_keeps_its_bounds_too() -> None:
    """Two joints turn the tool about z, 0.4 m apart: who asks for a turn alone gets a way as well."""
    random = np.random.default_rng(3)
    bounds, home = Bounds(Workspace((0.0, -0.2, 0.0), (1.0, 0.2, 1.0)), 0.05), build_parts(QUICK, 1, "clock")
    pose = home.kinematics.pose(home.arm.state(0.0))
    for _ in range(200):
        few = replace(pose, tool_jacobian=random.normal(size=(6, 4)), tool_position_m=np.array([0.5, 0.19, 0.5]))
        command = MotionCommand(Header(1, 1, 0.0), 0.0, 0.0, turning=(1.0, 0.5), run=True)
        limits = ArmLimits().of_joints(4)
        motion = commanded(command, few, np.zeros(4), limits, ToolMotionSettings(), bounds=bounds)
        linear_m_s = few.tool_jacobian[:3] @ motion.velocity_rad_s
        assert np.linalg.norm(linear_m_s) <= 0.05 + 1e-9
        assert 0.02 * linear_m_s[1] <= 0.01 + 1e-12


TABLE = """
[arm]
address = "tcp://127.0.0.1:5601"
fastest_m_s = 0.1
[arm.limits]
velocity_rad_s = [1.0, 2.0]
latency_s = 0.03
[arm.workspace]
lower_m = [0.2, -0.4, 0.02]
upper_m = [0.8, 0.4, 0.9]
[[arm.keep_out]]
center_m = [0.5, 0.3, 0.2]
half_sizes_m = [0.1, 0.05, 0.2]
"""


def test_the_table_of_the_arm_is_read(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(TABLE)
    settings = load_toml(file, RobotSettings)
    assert settings.arm == "tcp://127.0.0.1:5601"
    assert settings.arm_limits == ArmLimits(velocity_rad_s=(1.0, 2.0), latency_s=0.03)
    assert settings.bounds == Bounds(Workspace((0.2, -0.4, 0.02), (0.8, 0.4, 0.9)), 0.1)
    assert settings.arm_keep_out == (KeepOut((0.5, 0.3, 0.2), (0.1, 0.05, 0.2)),)
    assert settings.capped_motion.trigger_speed_m_s == 0.1


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("[arm.workspace]\nlower_m = [0, 0, 0]\nupper_m = [1, 1, 0]", "upper_m"),
        ("[[arm.keep_out]]\ncenter_m = [0, 0, 0]\nhalf_sizes_m = [1, 1, -1]", "half_sizes_m"),
        ("[arm]\nfastest_m_s = 0", "fastest_m_s"),
        ("[arm.limits]\nvelocity_rad_s = [1.0, 0.0]", "velocity_rad_s"),
        ("[arm]\nspeed = 1", "arm_speed"),
        ("[arm_limits]\nlatency_s = 0.1\n[arm.limits]\nlatency_s = 0.2", "arm_limits and arm.limits are both given"),
    ],
)
def test_a_wrong_table_is_told_by_its_key(tmp_path: Path, table: str, says: str) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(table)
    with pytest.raises((ConfigurationError, ValueError), match=says):
        load_toml(file, RobotSettings)
