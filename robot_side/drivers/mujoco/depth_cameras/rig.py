"""Simulated depth cameras, and the map of what they see."""

from collections import deque
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from common.roles import Role
from robot_side.depth.camera_settings import DepthCameraSettings, LinkMount
from robot_side.depth.perception import DepthPerception
from robot_side.depth.picture import CameraPose, DepthPicture, OwnBody
from robot_side.depth.sensor_errors import ErrorMaker
from robot_side.depth.sensors import SENSORS
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import SlotChanges
from robot_side.drivers.mujoco.depth_cameras.eyes import misplaced, simulated_eyes
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot, RobotParts
from robot_side.drivers.mujoco.depth_cameras.rendered import DepthCamera
from robot_side.drivers.mujoco.drawing.off_screen import choose_late
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.scene import Scene
from robot_side.surroundings.perceived import UnknownSpace

_SOON_S: Final = 1e-9
_LEAST_NOISE: Final = 0.25
"""Least factor of a camera's errors that is allowed for"""
_MOST_LABELS: Final = 255


class _Taken(NamedTuple):
    arrives_s: float
    eye: int
    picture: DepthPicture
    pose: CameraPose
    """Pose of the camera as it is believed"""
    body: OwnBody
    tool_m: FloatArray


class DepthRig:
    """Simulated depth cameras, and what is perceived by them; the caller says when, and shows the world."""

    def __init__(
        self, scene: Scene, settings: DepthCameraSettings, mapped: MapSettings, encoder: Encoder, seed: int
    ) -> None:
        """scene: at its start. encoder: reads the joints that place the cameras and the robot's own body.

        ConfigurationError where nothing can be rendered.
        """
        self._settings, self._mapped, self._encoder, self._robot_model = settings, mapped, encoder, scene.robot
        self._eyes = simulated_eyes(scene, settings.eyes)
        shape = settings.width, settings.height
        self._names = [thing.name for thing in scene.objects][:_MOST_LABELS]
        geoms = enumerate((thing.geoms for thing in scene.objects[:_MOST_LABELS]), start=1)
        labels = {geom: label for label, some in geoms for geom in some} if settings.labels else None
        choose_late()
        self._cameras = [DepthCamera(scene.model, *shape, eye.fovy_deg, labels=labels) for eye in self._eyes]
        parts = RobotParts.of(scene.robot)
        self._robot = PosedRobot(scene.model, parts, scene.data.qpos)
        sensor = SENSORS[settings.sensor]
        self.latency_s, self.rate_hz = sensor.latency_s, settings.rate_hz
        self._errors = sensor.depth_errors(max(settings.noise, _LEAST_NOISE))
        self._model, self._seed = scene.model, seed
        self._posed: Any = None
        self.restart()

    def restart(self, seed: int | None = None) -> None:
        """Forget what was seen; draw the errors anew, from another seed if one is given."""
        self._seed = self._seed if seed is None else seed
        settings, count = self._settings, len(self._eyes)
        draws = np.random.default_rng([self._seed, 0xDE]).spawn(2 * count)
        mounts = zip(self._eyes, draws[:count], strict=True)
        self._believed = [misplaced(eye.mount, settings.mount_error_m, draw) for eye, draw in mounts]
        sensor, shape = SENSORS[settings.sensor], (settings.height, settings.width)
        self._makers = [
            ErrorMaker(sensor, camera.pinhole, shape, int(draw.integers(2**31)), settings.noise)
            for camera, draw in zip(self._cameras, draws[count:], strict=True)
        ]
        self.perception = DepthPerception(self._mapped)
        self._under_way: deque[_Taken] = deque()

    def mounted(self) -> dict[str, LinkMount]:
        """Return where the cameras are taken to be, by name, in the order of their numbers."""
        return {
            eye.name: LinkMount(mount.position_m, mount.quaternion, eye.link)
            for eye, mount in zip(self._eyes, self._believed, strict=True)
        }

    def unknown(self) -> UnknownSpace:
        """Return the space around the tool that nobody has seen."""
        return self.perception.unknown(self._robot.tool_m(), self._robot.tool_rotation())

    def hold(self, held: FloatArray | None) -> None:
        """Take what the gripper holds from now on: (k, 4) spheres in the tool's frame; None if it holds nothing."""
        self._robot.held = np.empty((0, 4)) if held is None else held

    def explain(self, solids: FloatArray) -> None:
        """Take solids (k, 16) of known models out of the map, from the next picture on."""
        self._robot.models = solids

    def take_of(self, positions: FloatArray, now_s: float, roles: Mapping[str, Role]) -> None:
        """Take a picture with each camera of the state with qpos `positions` (nq,)."""
        if self._posed is None:
            self._posed = mujoco.MjData(self._model)
        self._posed.qpos[:] = positions
        mujoco.mj_kinematics(self._model, self._posed)
        self.take(self._posed, now_s, roles)

    def take(self, data: Any, now_s: float, roles: Mapping[str, Role]) -> None:
        """Take a picture with each camera of the state `data`; it arrives later. roles: of the objects by name."""
        robot = self._robot_model
        joints, fingers = data.qpos[robot.arm_positions], data.qpos[robot.finger_positions]
        self._robot.pose(joints, fingers)
        poses = [self._robot.camera(eye.link, eye.mount) for eye in self._eyes]
        self._robot.pose(self._encoder.read(joints), fingers)
        body, tool_m = self._robot.body(), self._robot.tool_m()
        # What stands in no relation to the task has no role, so that an operator may point at it.
        told = {label: roles[name] for label, name in enumerate(self._names, start=1)}
        known = {label: role for label, role in told.items() if role is not Role.OBSTACLE}
        for number, (eye, pose) in enumerate(zip(self._eyes, poses, strict=True)):
            true = self._cameras[number].picture(data, pose, now_s)
            seen = DepthPicture(now_s, self._makers[number].apply(true.depth_m), true.pinhole, true.labels, known)
            believed = self._robot.camera(eye.link, self._believed[number])
            self._under_way.append(_Taken(now_s + self.latency_s, number, seen, believed, body, tool_m))

    def arrived(self, now_s: float) -> tuple[SlotChanges, float] | None:
        """Map the pictures that have arrived; return the surfaces that changed, and the newest picture's time.

        None without a new picture.
        """
        newest: _Taken | None = None
        while self._under_way and self._under_way[0].arrives_s <= now_s + _SOON_S:
            newest = self._under_way.popleft()
            self.perception.see(newest.picture, newest.pose, newest.body, self._errors, newest.eye)
        return (
            None
            if newest is None
            else (
                self.perception.changes(newest.tool_m, holds=len(self._robot.held) > 0),
                newest.picture.taken_s,
            )
        )

    def close(self) -> None:
        """Free the graphics resources."""
        for camera in self._cameras:
            camera.close()
