"""First true contact and its closing speed, on scripted motions without physics of the arm."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.roles import Role
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.tick.truth import ContactOnset
from tests.helpers.repository import DATA

STEP_S = 0.001
WAY_M = 0.32
"""Distance ahead from the home pose to the contact, in metres, in the scenes used here (see test_frozen_scenes.py)"""
AHEAD = np.array([1.0, 0.0, 0.0])
DOWN = np.array([0.0, 0.0, -1.0])
STILL = np.zeros(3)


@dataclass
class Script:
    """Gripper that moves exactly as the test says, step by step, even through objects."""

    scene: Scene
    held: str | None = None
    """Name of the object that moves with the gripper, if any"""
    truth: TrueContact = field(init=False)

    def __post_init__(self) -> None:
        self.truth = TrueContact(self.scene)

    @staticmethod
    def load(path: Path | str, held: str | None = None) -> "Script":
        return Script(load_scene(path if isinstance(path, Path) else DATA / f"{path}.xml", "tool"), held)

    def step(self, velocity_m_s: FloatArray, turning_rad_s: FloatArray = STILL, **joints: float) -> ContactOnset | None:
        """Move the tool for one step at this linear and angular velocity in the world frame; return a new contact.

        joints: velocities of further joints, by name.
        """
        model, data, robot = self.scene.model, self.scene.data, self.scene.robot
        jacobian = np.zeros((6, model.nv))
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], robot.site)
        data.qvel[:] = 0.0
        twist = np.concatenate([velocity_m_s, turning_rad_s])
        data.qvel[robot.arm_velocities] = np.linalg.solve(jacobian[:, robot.arm_velocities], twist)
        for name, speed in joints.items():
            data.qvel[model.joint(name).dofadr[0]] = speed
        if self.held is not None:
            free = int(model.body(self.held).dofadr[0])
            data.qvel[free : free + 3] = velocity_m_s
        mujoco.mj_integratePos(model, data.qpos, data.qvel, STEP_S)
        data.time += STEP_S
        mujoco.mj_forward(model, data)
        return self.truth.update(self.held)

    def until_contact(
        self, velocity_m_s: FloatArray, turning_rad_s: FloatArray = STILL, steps: int = 2000, **joints: float
    ) -> ContactOnset | None:
        for _ in range(steps):
            if (onset := self.step(velocity_m_s, turning_rad_s, **joints)) is not None:
                return onset
        return None

    def go(self, way_m: float, direction: FloatArray = AHEAD) -> "Script":
        """Move the tool by `way_m` along `direction`, in steps of 1 mm that each correct the last one's error."""
        tool = self.scene.data.site_xpos[self.scene.robot.site]
        path = np.linspace(tool, tool + way_m * direction, math.ceil(way_m / 0.001) + 1)
        for place_m in path[1:]:
            assert self.step((place_m - tool) / STEP_S) is None
        return self


def speed_of_coming_nearer(
    script: Script, velocity_m_s: FloatArray, turning_rad_s: FloatArray = STILL, **joints: float
) -> float:
    """Move until the contact; return how fast the gap fell in the last step before it."""
    gaps = [script.truth.gap_m(script.held)]
    while script.step(velocity_m_s, turning_rad_s, **joints) is None:
        gaps.append(script.truth.gap_m(script.held))
        assert len(gaps) < 3000
    return (gaps[-2] - gaps[-1]) / STEP_S


@pytest.mark.parametrize("speed_m_s", [0.25, 0.04])
def test_onto_a_wall_it_closes_at_the_speed_it_has(speed_m_s: float) -> None:
    onset = Script.load("wall").go(0.316).until_contact(speed_m_s * AHEAD)
    assert onset is not None
    assert onset.thing == "wall"
    assert onset.gripper_part.endswith("fingertip")
    assert onset.closing_speed_m_s == pytest.approx(speed_m_s, rel=1e-3)


@pytest.mark.parametrize("turning_rad_s", [0.5, -0.5])
@pytest.mark.parametrize("name", ["wall", "wall_45"])
def test_a_gripper_that_turns_closes_as_fast_as_the_distance_falls(name: str, turning_rad_s: float) -> None:
    """The fingertips are 15 mm ahead of the tool and 50 mm beside it, so turning alone moves them at 25 mm/s."""
    motion = 0.05 * AHEAD, np.array([0.0, 0.0, turning_rad_s])
    onset = Script.load(name).go(0.312).until_contact(*motion)
    assert onset is not None
    falling_m_s = speed_of_coming_nearer(Script.load(name).go(0.312), *motion)
    assert onset.closing_speed_m_s == pytest.approx(falling_m_s, rel=0.03)


def test_of_several_contacts_the_fastest_counts() -> None:
    """The second step puts both fingertips into the wall at once; the outer one is faster, as the gripper turns."""
    script, motion = Script.load("wall").go(0.3185), (1.0 * AHEAD, np.array([0.0, 0.0, 4.0]))
    assert script.step(*motion) is None
    onset = script.step(*motion)
    assert onset is not None
    assert len({tuple(contact.geom) for contact in script.scene.data.contact}) == 2
    outer = min(("left_fingertip", "right_fingertip"), key=lambda tip: script.scene.data.geom(tip).xpos[1])
    assert onset.gripper_part == outer
    assert onset.closing_speed_m_s == pytest.approx(1.0 + 4.0 * 0.0545, rel=1e-2)


def test_a_contact_that_goes_on_is_reported_at_its_onset_alone() -> None:
    script = Script.load("wall").go(0.319)
    assert script.until_contact(0.1 * AHEAD) is not None
    assert script.until_contact(0.02 * AHEAD, steps=50) is None
    # Leaving the wall and touching it again is another onset.
    assert script.until_contact(-0.1 * AHEAD, steps=50) is None
    again = script.until_contact(0.03 * AHEAD)
    assert again is not None
    assert again.closing_speed_m_s == pytest.approx(0.03, rel=1e-2)


def test_a_held_object_counts_as_gripper() -> None:
    script = Script.load("place_held", held="target").go(0.316, DOWN)
    assert script.truth.gap_m("target") == pytest.approx(0.004, abs=1e-4)
    onset = script.until_contact(0.1 * DOWN)
    assert onset is not None
    assert onset.thing == "table"
    [target] = [thing for thing in script.scene.objects if thing.name == "target"]
    assert onset.gripper_part in {f"geom{geom}" for geom in target.geoms}
    assert onset.closing_speed_m_s == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize("gone_m", [0.0, 0.2, 0.31])
def test_the_way_to_a_hill_of_a_height_field_is_not_passed_over(gone_m: float) -> None:
    truth = Script.load("terrain_ahead").go(gone_m).truth
    # Lower ground is nearer than the hill.
    assert truth.gap_m(None) < WAY_M - gone_m
    assert truth.way_left_m(AHEAD, None) == pytest.approx(WAY_M - gone_m, abs=1e-4)


def test_the_approach_is_the_tools_axis_and_the_speed_along_it() -> None:
    script = Script.load("place_held", held="target")
    axis, speed_m_s = script.truth.approach()
    np.testing.assert_allclose(axis, DOWN, atol=1e-4)
    assert speed_m_s == pytest.approx(0.0, abs=1e-12)
    for velocity_m_s, along_m_s in ((0.2 * DOWN, 0.2), (-0.1 * DOWN, -0.1), (0.2 * AHEAD, 0.0)):
        script.step(velocity_m_s)
        assert script.truth.approach()[1] == pytest.approx(along_m_s, abs=1e-3)


def test_a_support_counts_only_where_it_is_asked_for() -> None:
    scene = load_scene(DATA / "wall.xml", "tool", {"wall": Role.SUPPORT})
    found = []
    for supports in (True, False):
        script = Script(scene)
        mujoco.mj_resetDataKeyframe(scene.model, scene.data, scene.model.key("home").id)
        mujoco.mj_forward(scene.model, scene.data)
        script.truth = TrueContact(scene, supports=supports)
        found.append(script.go(0.319).until_contact(0.1 * AHEAD, steps=50))
    assert [None if one is None else one.thing for one in found] == ["wall", None]
