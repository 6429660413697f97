"""What rests in a built-in scene sleeps, and wakes as soon as anything happens to it."""

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from robot_side.simulation.ground_truth import GroundTruth
from robot_side.simulation.scene import Scene
from robot_side.simulation.true_contact import TrueContact
from tests.helpers.tool_driver import ToolDriver

FREE = ("target", "carton", "tin", "block", "book", "ball", "orange", "tetrahedron")
SLEEP = int(mujoco.mjtEnableBit.mjENBL_SLEEP)


def asleep(scene: Scene) -> set[str]:
    """The free bodies that sleep."""
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


def test_what_the_gripper_pushes_wakes_and_the_rest_sleeps_on() -> None:
    driver = ToolDriver.load()
    contact, onsets = TrueContact(driver.scene), []
    driver.wait(0.5)
    assert "target" in asleep(driver.scene)
    before_m = position_m(driver.scene, "target")
    driver.grip(1.0, 1.0)
    driver.go_to(np.array([0.62, 0.0, 0.07]), 1.0)
    assert driver.contacts == set()
    for _ in range(12):
        driver.go_to(np.array([0.76, 0.0, 0.07]), 0.1)
        onsets.append(contact.update(None))
    assert {name for _, name in driver.contacts} == {"target"}
    assert [onset.thing for onset in onsets if onset is not None][:1] == ["target"]
    assert position_m(driver.scene, "target")[0] > before_m[0] + 0.01
    assert "target" not in asleep(driver.scene)
    assert {"book", "tetrahedron", "ball"} <= asleep(driver.scene)
    driver.go_to(np.array([0.62, 0.0, 0.07]), 1.5)
    driver.wait(1.0)
    assert "target" in asleep(driver.scene)
    assert GroundTruth(driver.scene).observe().contacts == frozenset()
