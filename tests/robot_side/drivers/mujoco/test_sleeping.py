"""Objects at rest in a built-in scene fall asleep, and lie where they would lie without sleeping."""

from pathlib import Path
from typing import get_args

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import planar_arm
from tests.helpers.tool_driver import ToolDriver

FREE = ("target", "carton", "tin", "block", "book", "ball", "orange", "tetrahedron")
SLEEP = int(mujoco.mjtEnableBit.mjENBL_SLEEP)


def asleep(scene: Scene) -> set[str]:
    model, data = scene.model, scene.data
    bodies = {name: model.body(f"table_scene/{name}").id for name in FREE}
    return {name for name, body in bodies.items() if not data.tree_awake[model.body_treeid[body]]}


def position_m(scene: Scene, name: str) -> FloatArray:
    position: FloatArray = scene.data.body(f"table_scene/{name}").xpos.copy()
    return position


def test_what_rests_sleeps_where_it_would_stand_awake() -> None:
    sleeping, waking = ToolDriver.load(), ToolDriver.load()
    waking.scene.model.opt.enableflags &= ~SLEEP
    for driver in (sleeping, waking):
        driver.wait(2.0)
    assert asleep(sleeping.scene) == set(FREE)
    assert asleep(waking.scene) == set()
    for name in FREE:
        np.testing.assert_allclose(position_m(sleeping.scene, name), position_m(waking.scene, name), atol=1e-4)


@pytest.mark.parametrize("name", get_args(SceneName))
def test_things_may_sleep_before_the_built_in_arm_alone(name: SceneName, tmp_path: Path) -> None:
    assert load_scene(name=name).model.opt.enableflags & SLEEP
    # A foreign arm without a scene gets the same objects, and its model's options hold.
    assert not load_scene(planar_arm(tmp_path), "tcp", name=name).model.opt.enableflags & SLEEP
