"""Grippers in their spheres, from the front and from the side."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from robot_side.arm.port import ArmState
from robot_side.simulation.gripper_cover import placed_corners
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import Scene


def draw(grippers: Sequence[tuple[str, Scene]], path: Path) -> None:
    """A column for each gripper: the geoms' hulls in black on their spheres, in the tool's frame, approach upwards."""
    from matplotlib import pyplot as plt  # noqa: PLC0415
    from matplotlib.collections import EllipseCollection, PolyCollection  # noqa: PLC0415

    figure, axes = plt.subplots(
        2, len(grippers), figsize=(3.2 * len(grippers), 6.4), dpi=110, layout="constrained", squeeze=False
    )
    for column, (name, scene) in enumerate(grippers):
        robot, data = scene.robot, scene.data
        joints, fingers = data.qpos[robot.arm_positions], data.qpos[robot.finger_positions]
        pose = MujocoKinematics(scene).pose(ArmState(0.0, joints, np.zeros_like(joints), fingers, 0.0, False))
        centers = 1e3 * (pose.sphere_centers_m - pose.tool_position_m) @ pose.tool_rotation
        corners = 1e3 * (placed_corners(scene.model, data, robot.gripper_geoms) - pose.tool_position_m)
        corners = corners @ pose.tool_rotation
        sizes = 2e3 * pose.sphere_radii_m
        for row, across in enumerate((0, 1)):
            seen = axes[row, column]
            spheres = EllipseCollection(
                sizes, sizes, np.zeros_like(sizes), units="xy", offsets=centers[:, [across, 2]],
                offset_transform=seen.transData,
                facecolor=(0.3, 0.55, 0.85, 0.25), edgecolor=(0.1, 0.3, 0.6, 0.5), linewidth=0.4,
            )  # fmt: skip
            seen.add_collection(spheres)
            seen.add_collection(PolyCollection(list(corners[:, :, [across, 2]]), facecolor=(0.0, 0.0, 0.0, 0.25)))
            seen.set(aspect="equal", xlabel=f"{'xy'[across]} of the tool, mm")
            seen.autoscale_view()
        axes[0, column].set_title(f"{name}: {len(sizes)} spheres", fontsize=9)
        axes[0, 0].set_ylabel("along the approach, mm")
    figure.savefig(path)
    plt.close(figure)
