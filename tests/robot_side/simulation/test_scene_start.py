"""How a scene starts: what moves does so at once, what cannot be is refused, and what nobody lifts is known."""

from pathlib import Path

import numpy as np
import pytest

from common.errors import ConfigurationError
from robot_side.simulation.scene import Scene, load_scene
from tests.helpers.repository import DATA

QPOS = "-0.45168 -1.55140 2.37501 -0.82361 1.11912 1.57080 0.0425 0.0425"
MOVER = '<body name="mover" pos="0.9 0 0.2"><joint name="mover" type="slide" axis="1 0 0"/><geom size="0.02"/></body>'
POST = '<geom name="post" type="box" size="0.02 0.02 0.3" pos="{place} 0.3"/>'


def scene(folder: Path, world: str, qpos: str = "", qvel: str = "") -> Scene:
    path = folder / "scene.xml"
    speeds = f'qvel="{qvel}"' if qvel else ""
    path.write_text(
        f'<mujoco><include file="{DATA / "arm.xml"}"/><worldbody>{world}</worldbody>'
        f'<keyframe><key name="home" qpos="{QPOS} {qpos}" {speeds}/></keyframe></mujoco>'
    )
    return load_scene(path, "tool")


def test_what_a_keyframe_sets_in_motion_moves_and_the_robot_rests(tmp_path: Path) -> None:
    loaded = scene(tmp_path, MOVER, "0.05", "0.3 0 0 0 0 0.1 0.2 0 -0.5")
    np.testing.assert_array_equal(loaded.data.qvel, [0.0] * 8 + [-0.5])


@pytest.mark.parametrize("speed", ["nan", "inf"])
def test_a_velocity_that_is_no_number_is_refused(tmp_path: Path, speed: str) -> None:
    with pytest.raises(ConfigurationError, match="keyframe 'home' holds NaN or infinity; valid: finite qvel"):
        scene(tmp_path, MOVER, "0.05", f"0 0 0 0 0 0 0 0 {speed}")


def test_a_place_that_is_no_number_is_refused_by_the_name_of_what_stands_there(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"model: .*post.*valid: "):
        scene(tmp_path, POST.format(place="nan 0"))


def test_what_no_joint_moves_is_fixed(tmp_path: Path) -> None:
    assert scene(tmp_path, MOVER + POST.format(place="0.9 0.3"), "0").fixed == {"post"}
    assert load_scene().fixed == {"floor", "table"}
