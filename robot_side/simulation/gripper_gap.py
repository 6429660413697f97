"""How much of the free gap between a gripper's fingers its spheres leave."""

import mujoco  # type: ignore[import-untyped]
import numpy as np

from robot_side.simulation.gripper_cover import GripperCover
from robot_side.simulation.gripper_measurement import measure_gripper
from robot_side.simulation.gripper_travel import jaw_pairs
from robot_side.simulation.scene import Scene

_FARTHEST_M = 0.5


def open_gap(scene: Scene, cover: GripperCover) -> tuple[float, float] | None:
    """(m between the two links that grip, m between their spheres) with the gripper open; None without fingers."""
    travel, model, robot = measure_gripper(scene), scene.model, scene.robot
    if travel is None:
        return None
    data = mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    data.qpos[robot.finger_positions] = travel.open_fingers
    mujoco.mj_forward(model, data)
    bodies = model.geom_bodyid[robot.gripper_geoms]
    gaps = {
        pair: mujoco.mj_geomDistance(model, data, *pair, _FARTHEST_M, None)
        for pair in jaw_pairs(robot.gripper_geoms, bodies, robot.geom_on_finger)
    }
    gripping = min(gaps, key=lambda pair: abs(gaps[pair] - travel.openings_m[0]))
    links = {int(model.geom_bodyid[geom]) for geom in gripping}
    true_m = min(gap for pair, gap in gaps.items() if {int(model.geom_bodyid[geom]) for geom in pair} == links)
    one, other = (
        (
            data.xpos[link] + cover.centers_m[cover.bodies == link] @ data.xmat[link].reshape(3, 3).T,
            cover.radii_m[cover.bodies == link],
        )
        for link in links
    )
    apart = np.linalg.norm(one[0][:, None] - other[0], axis=2) - one[1][:, None] - other[1]
    return float(true_m), max(float(apart.min()), 0.0)
