"""How well the doctor solves a mount: python -m tests.robot_side.depth.mounts, about a minute on an idle core.

Pictures of the built-in arm at its table, by casting rays, with the errors of a D435. The model is exact.
"""

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.commissioning.depth_figures import Look
from robot_side.commissioning.mount_solving import Refused, Solved, solve_mount
from robot_side.depth.camera_settings import LinkMount
from robot_side.depth.picture import CameraPose, DepthArray, DepthPicture, Pinhole
from robot_side.depth.sensor_errors import ErrorMaker
from robot_side.depth.sensors import SENSORS
from robot_side.drivers.mujoco.depth_cameras.eyes import simulated_eyes
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot, RobotParts
from robot_side.drivers.mujoco.scene import load_scene
from tests.robot_side.depth.ray_cast import looking

HEIGHT, WIDTH = 240, 320
_FOCAL_PX: Final = 0.5 * HEIGHT / np.tan(np.radians(29.0))
PINHOLE: Final = Pinhole(_FOCAL_PX, _FOCAL_PX, 0.5 * WIDTH, 0.5 * HEIGHT)
_SEEDS: Final = range(5)


class Told(NamedTuple):
    """How wrong an answer is."""

    off_m: FloatArray
    """(3,) error of what is at the middle of the seen robot, along the camera's axes"""
    off_rad: float


class Desk:
    """Built-in arm at its table, before a camera in the world, or on its gripper."""

    def __init__(self, eye: str = "fixed", mount: LinkMount | None = None) -> None:
        """mount: of another camera than the simulated one."""
        self.scene = load_scene()
        (own,) = simulated_eyes(self.scene, eye)
        self.mount = mount or LinkMount(own.mount.position_m, own.mount.quaternion, own.link)
        self.robot = PosedRobot(self.scene.model, RobotParts.of(self.scene.robot), self.scene.data.qpos)
        self._data = mujoco.MjData(self.scene.model)

    def poses(self, count: int, seed: int, spread_rad: float = 0.2) -> list[FloatArray]:
        """Return joints of the arm about its start."""
        start = self.scene.data.qpos[self.scene.robot.arm_positions]
        draws = np.random.default_rng(seed).uniform(-spread_rad, spread_rad, (count, len(start)))
        return list(start + draws)

    def look(
        self,
        poses: Sequence[FloatArray],
        error_m: float,
        error_rad: float,
        seed: int = 0,
        level: float = 1.0,
        zeros_rad: float = 0.0,
    ) -> tuple[list[Look], LinkMount]:
        """Return looks by a mount that is wrong in a drawn direction, and this mount.

        level: of the camera's errors. zeros_rad: standard deviation of the joints' zero offsets.
        """
        draw, sensor = np.random.default_rng([seed, 0x3F]), SENSORS["d435"]
        maker = ErrorMaker(sensor, PINHOLE, (HEIGHT, WIDTH), seed, level)
        ways = draw.standard_normal((2, 3))
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        turned = Rotation.from_quat(self.mount.quaternion, scalar_first=True) * Rotation.from_rotvec(
            error_rad * ways[1]
        )
        x, y, z = (np.array(self.mount.position_m) + error_m * ways[0]).tolist()
        w, i, j, k = turned.as_quat(scalar_first=True).tolist()
        believed = LinkMount((x, y, z), (w, i, j, k), self.mount.link)
        zeros = zeros_rad * draw.standard_normal(len(poses[0]))
        fingers, looks = self.scene.data.qpos[self.scene.robot.finger_positions], []
        for arm in poses:
            self.robot.pose(arm, fingers)
            seen = DepthPicture(0.0, maker.apply(self._depths(arm)), PINHOLE)
            self.robot.pose(arm + zeros, fingers)
            pose = self.robot.camera(believed.link, believed)
            looks.append(Look(seen, pose, arm + zeros, fingers, sensor.depth_errors()))
        return looks, believed

    def _depths(self, arm: FloatArray) -> DepthArray:
        """Return the true depth (h, w), also of all that stands around."""
        data, scene = self._data, self.scene
        data.qpos[:] = scene.data.qpos
        data.qpos[scene.robot.arm_positions] = arm
        mujoco.mj_kinematics(scene.model, data)
        pose = self.robot.camera(self.mount.link, self.mount)
        return cast(scene.model, data, pose)

    def told(self, answer: Solved, believed: LinkMount) -> Told:
        """Judge an answer."""
        right, found, at_m = self.mount, answer.corrected(believed), answer.at_m
        turn = right.axes().T @ found.axes()
        off_m = turn @ at_m + right.axes().T @ np.subtract(found.position_m, right.position_m) - at_m
        return Told(off_m, float(Rotation.from_matrix(turn).magnitude()))


def cast(model: mujoco.MjModel, data: mujoco.MjData, pose: CameraPose) -> DepthArray:
    """Return the true depth (h, w) of all that pictures show; 0 where nothing is."""
    row, column = (grid.ravel() + 0.5 for grid in np.mgrid[:HEIGHT, :WIDTH])
    rays = np.stack([(column - PINHOLE.cx) / PINHOLE.fx, (row - PINHOLE.cy) / PINHOLE.fy, np.ones(row.size)], axis=1)
    geoms, depths_m = np.empty(row.size, np.int32), np.empty(row.size)
    shown, ways = np.array([1, 1, 1, 0, 0, 0], np.uint8), (rays @ pose.rotation.T).ravel()
    mujoco.mj_multiRay(model, data, pose.position_m, ways, shown, 1, -1, geoms, depths_m, None, row.size, 10.0)
    return np.where(geoms >= 0, depths_m, 0.0).reshape(HEIGHT, WIDTH).astype(np.float32)


def mount_at(position_m: tuple[float, float, float], at_m: tuple[float, float, float]) -> LinkMount:
    """Return the mount of a camera in the world that looks at a point."""
    w, x, y, z = Rotation.from_matrix(looking(position_m, at_m).rotation).as_quat(scalar_first=True).tolist()
    return LinkMount(position_m, (w, x, y, z))


FAR: Final = mount_at((0.4, -1.1, 0.7), (0.2, 0.0, 0.3))
_POSES: Final = (1, 3, 5, 10)
_ERRORS: Final = ((5.0, 0.5), (40.0, 2.0), (80.0, 4.0), (120.0, 12.0))
"""Of the believed mount, in mm and degrees; besides 20 mm and 2 degrees"""


def row(desk: Desk, poses: int, error: tuple[float, float], level: float = 1.0, zeros_deg: float = 0.0) -> str:
    """Return what came out of some draws."""
    found, ratios, refused = [], [], 0
    for seed in _SEEDS:
        arms = desk.poses(poses, seed)
        looks, believed = desk.look(
            arms, 1e-3 * error[0], np.radians(error[1]), seed, level, zeros_rad=np.radians(zeros_deg)
        )
        if isinstance(answer := solve_mount(looks, desk.robot), Refused):
            refused += 1
            continue
        off_m, off_rad = desk.told(answer, believed)
        found.append((np.linalg.norm(off_m), abs(off_m[2]), np.degrees(off_rad)))
        ratios.append(off_m @ np.linalg.solve(answer.covariance[3:, 3:], off_m) / 3.0)
    if not found:
        return f"{refused} refused"
    (off, most), (along, _), (turned, turned_most) = zip(*(call(found, 0) for call in (np.median, np.max)), strict=True)
    return (
        f"{1e3 * off:.1f} ({1e3 * most:.1f}) mm, {1e3 * along:.1f} along the view,"
        f" {turned:.2f} ({turned_most:.2f}) deg, {np.sqrt(np.mean(ratios)):.1f} standard deviations, {refused} refused"
    )


def rows() -> Iterator[tuple[str, str]]:
    """Yield what was tried, and what came out: median, and most."""
    near, far = Desk(), Desk(mount=FAR)
    for poses in _POSES:
        yield f"0.6 m, {poses} poses, wrong by 20 mm and 2 deg", row(near, poses, (20.0, 2.0))
        yield f"1.2 m, {poses} poses, wrong by 20 mm and 2 deg", row(far, poses, (20.0, 2.0))
    for error in _ERRORS:
        yield f"0.6 m, 3 poses, wrong by {error[0]:g} mm and {error[1]:g} deg", row(near, 3, error)
    yield "0.6 m, 5 poses, noise times 3", row(near, 5, (20.0, 2.0), 3.0)
    yield "0.6 m, 5 poses, zero offsets of 0.1 deg", row(near, 5, (20.0, 2.0), zeros_deg=0.1)
    yield "1.2 m, 5 poses, zero offsets of 0.1 deg", row(far, 5, (20.0, 2.0), zeros_deg=0.1)
    yield "on the gripper, 5 poses", row(Desk("wrist"), 5, (5.0, 0.5))


if __name__ == "__main__":
    for what, came in rows():
        print(f"{what}: {came}", flush=True)
