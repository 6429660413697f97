"""Pictures in the companion: from simulated cameras, or from processes that send them; and the map of both."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple, Protocol

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.roles import Role
from robot_side.depth.camera_settings import LinkMount
from robot_side.depth.perception import DepthPerception
from robot_side.depth.picture import SOLID_NUMBERS, DepthErrors
from robot_side.depth.slots import SlotChanges
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.remote.depth import RemoteDepth, TakenDepth
from robot_side.perceiving.exchange import Joints
from robot_side.surroundings.perceived import UnknownSpace

_REMEMBERED_S: Final = 3.0
"""Time for which the robot's motion is remembered"""
_LATE_S: Final = 1.0
"""Age from which on a picture is left out: where its camera was is not known well"""


class News(NamedTuple):
    """Surfaces after new pictures."""

    changes: SlotChanges
    taken_s: tuple[float, float]
    """Earliest and latest time of the newest picture"""


class Taking(Protocol):
    """Source of news."""

    @property
    def perception(self) -> DepthPerception:
        """Map of the pictures"""
        ...

    def unknown(self) -> UnknownSpace:
        """Return the space around the tool that nobody has seen."""
        ...

    def hear(self, joints: Joints) -> None:
        """Take where the robot was."""
        ...

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of an object, by its name at the robot side."""
        ...

    def forget(self) -> None:
        """Forget what was seen, as the objects were put back."""
        ...

    def step(self, now_s: float) -> News | None:
        """Take the pictures that are due or have arrived; None without any."""
        ...


class SimulatedPictures:
    """Pictures of the newest state of a simulation."""

    def __init__(self, scene: Scene, rig: DepthRig) -> None:
        self._rig, self._roles = rig, scene.roles
        self._next_s = -np.inf
        self._positions: FloatArray | None = None
        """qpos of the newest state"""

    @property
    def perception(self) -> DepthPerception:
        """Map of the pictures"""
        return self._rig.perception

    @property
    def mounted(self) -> dict[str, LinkMount]:
        """Where the cameras are taken to be, by name"""
        return self._rig.mounted()

    def unknown(self) -> UnknownSpace:
        """Return the space around the tool that nobody has seen."""
        return self._rig.unknown()

    def hear(self, joints: Joints) -> None:
        """Take where everything was."""
        self._positions = np.frombuffer(joints.positions)
        self._rig.hold(np.frombuffer(joints.held).reshape(-1, 4))
        if joints.models is not None:
            self._rig.explain(np.frombuffer(joints.models).reshape(-1, SOLID_NUMBERS))

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of a surface."""
        self._rig.perception.set_role(name, role)

    def forget(self) -> None:
        """Forget what was seen."""
        self._rig.restart()

    def step(self, now_s: float) -> News | None:
        """Render the pictures that are due, and map those that have arrived."""
        if self._positions is not None and now_s >= self._next_s:
            self._next_s = max(self._next_s + 1.0 / self._rig.rate_hz, now_s)
            self._rig.take_of(self._positions, now_s, self._roles)
        news = self._rig.arrived(now_s)
        return None if news is None else News(news[0], (news[1], news[1]))


class SentPictures:
    """Pictures that processes send, each mapped from where the robot was when it was taken."""

    def __init__(
        self,
        remote: RemoteDepth,
        robot: PosedRobot,
        mounts: Mapping[str, LinkMount],
        perceive: Callable[[], DepthPerception],
        errors: DepthErrors,
    ) -> None:
        """mounts: by camera, before those that are sent. perceive: makes an empty map. errors: of the cameras."""
        self._remote, self._robot, self._mounts, self._errors = remote, robot, mounts, errors
        self.perception, self._perceive = perceive(), perceive
        self._motion: deque[tuple[float, FloatArray, FloatArray]] = deque()
        self._models: deque[tuple[float, FloatArray]] = deque()
        """Solids of known models, and from when on they were there"""
        self.cameras: dict[str, int] = {}
        """Numbers of the cameras whose pictures were mapped, by name"""
        self.mounted: dict[str, LinkMount] = {}
        """Where these cameras are taken to be"""
        self._taken_s: dict[str, tuple[float, float]] = {}
        """Earliest and latest time of each camera's newest picture"""

    def hear(self, joints: Joints) -> None:
        """Take where the robot was."""
        self._robot.held = np.frombuffer(joints.held).reshape(-1, 4)
        if joints.models is not None:
            self._models.append((joints.time_s, np.frombuffer(joints.models).reshape(-1, SOLID_NUMBERS)))
            while len(self._models) > 1 and self._models[1][0] < joints.time_s - _REMEMBERED_S:
                self._models.popleft()
        self._motion.append((joints.time_s, np.frombuffer(joints.arm), np.frombuffer(joints.fingers)))
        while self._motion[0][0] < joints.time_s - _REMEMBERED_S:
            self._motion.popleft()

    def unknown(self) -> UnknownSpace:
        """Return the space around the tool that nobody has seen."""
        return self.perception.unknown(self._robot.tool_m(), self._robot.tool_rotation())

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of a surface."""
        self.perception.set_role(name, role)

    def forget(self) -> None:
        """Forget what was seen."""
        self.perception = self._perceive()

    def step(self, now_s: float) -> News | None:
        """Map the pictures that have arrived."""
        news = False
        for camera in self._remote.update(now_s):
            taken = self._remote.take(camera)
            if taken is not None and self._map(camera, taken, now_s):
                self._taken_s[camera] = taken.picture.taken_s, taken.latest_s
                news = True
        if not news:
            return None
        # The map is as old as the newest picture of the camera that is furthest behind, but for those that are silent.
        taken_s = min(times for times in self._taken_s.values() if now_s - times[1] <= _LATE_S)
        holds = len(self._robot.held) > 0
        return News(self.perception.changes(self._robot.tool_m(), holds=holds), taken_s)

    def _map(self, camera: str, taken: TakenDepth, now_s: float) -> bool:
        """Map a picture; False if it is too old, or nobody knows where its camera was."""
        sent = taken.mount
        mount = self._mounts.get(camera)
        if mount is None and sent is not None:
            mount = LinkMount(sent.position_m, sent.quaternion, sent.link)
        if mount is None:
            text = f"no mount is known; valid: [depth.mounts.{camera}], or mount in it"
            self._remote.refuse("mount", camera, text, now_s)
            return False
        middle_s = 0.5 * (taken.picture.taken_s + taken.latest_s)
        if now_s - middle_s > _LATE_S:
            text = f"{now_s - middle_s:.1f} s old; valid: up to {_LATE_S:g} s"
            self._remote.refuse("late", camera, text, now_s)
        if not self._motion or now_s - middle_s > _LATE_S:
            return False
        self._robot.pose(*self._joints_at(middle_s))
        for from_s, solids in self._models:
            if from_s <= middle_s or from_s == self._models[0][0]:
                self._robot.models = solids
        try:
            pose = self._robot.camera(mount.link, mount)
        except ConfigurationError as error:
            self._remote.refuse("mount", camera, str(error), now_s)
            return False
        number = self.cameras.setdefault(camera, len(self.cameras))
        self.mounted[camera] = mount
        self.perception.see(taken.picture, pose, self._robot.body(), self._errors, number)
        return True

    def _joints_at(self, time_s: float) -> tuple[FloatArray, FloatArray]:
        """Return the readings of arm and fingers at a time, interpolated."""
        times = [at for at, *_ in self._motion]
        after = int(np.searchsorted(times, time_s))
        if after in (0, len(times)):
            return self._motion[min(after, len(times) - 1)][1:]
        (from_s, *before), (until_s, *later) = self._motion[after - 1], self._motion[after]
        part = (time_s - from_s) / (until_s - from_s)
        arm, fingers = ((1.0 - part) * one + part * other for one, other in zip(before, later, strict=True))
        return arm, fingers
