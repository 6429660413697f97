"""Ports of the settings --arm, --objects, --pictures and --depth, and the wait for the first messages over these."""

from collections.abc import Callable
from typing import Any, Final, Protocol

from common.roles import Role
from common.sockets.door.client import Door
from common.sockets.door.messages import DriverSettings
from robot_side.arm.limits import ArmLimits
from robot_side.arm.port import ArmState
from robot_side.depth.camera_settings import DEPTH_PORT
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.depth_message import DEPTH_LIMIT_BYTES
from robot_side.drivers.remote.driver_session import ArmShape
from robot_side.drivers.remote.frame_message import FRAME_LIMIT_BYTES
from robot_side.drivers.remote.messages import STATE_LIMIT_BYTES
from robot_side.drivers.remote.objects import RemoteObjects
from robot_side.drivers.remote.picture_message import PICTURE_LIMIT_BYTES
from robot_side.drivers.remote.pictures import RemotePictures
from robot_side.surroundings.perceived import PerceivedObjects

_TURN_S: Final = 0.004
_STATES_BYTES_PER_S: Final = 4e6
_FRAMES_BYTES_PER_S: Final = 16e6
"""Budgets of a driver's states, 1000 a second, and of a perception, whose usual frames have some kilobytes"""
_PICTURES_BYTES_PER_S: Final = 16e6
"""Budget of a camera process: JPEG, or one view of 640 x 480 in rgb8 at 15 Hz"""
_DEPTH_BYTES_PER_S: Final = 64e6
"""Budget of a depth camera's process: 848 x 480 pixels with labels at 30 Hz, and some more"""
_AWAITED: Final = {"--arm": "an arm's driver", "--objects": "a process that perceives objects"}


def driver_ports(
    arm: str | None, objects: str | None, pictures: str | None = None, depth: str | None = None
) -> dict[str, DriverSettings]:
    """Return the settings of the ports at which programs connect, keyed by flag."""
    found: dict[str, DriverSettings] = {}
    if arm is not None:
        found["--arm"] = DriverSettings(arm, "driver", STATE_LIMIT_BYTES, _STATES_BYTES_PER_S)
    if objects is not None:
        found["--objects"] = DriverSettings(objects, "perception", FRAME_LIMIT_BYTES, _FRAMES_BYTES_PER_S)
    if pictures is not None:
        limits = PICTURE_LIMIT_BYTES, _PICTURES_BYTES_PER_S
        found["--pictures"] = DriverSettings(pictures, "perception", *limits, on_request=True)
    if depth is not None:
        found[DEPTH_PORT] = DriverSettings(depth, "perception", DEPTH_LIMIT_BYTES, _DEPTH_BYTES_PER_S)
    return found


class Summarized(Protocol):
    """Source with figures of its own."""

    def summary(self) -> dict[str, Any]:
        """Return the figures."""
        ...


class ConnectedDrivers:
    """Programs that connect at the ports of the settings: they drive the arm, perceive objects, or send pictures."""

    def __init__(self, door: Door, note: Callable[[str], None]) -> None:
        """door: made with the settings of `driver_ports`. note: called with lines that people read."""
        self._note, self._ports = note, door.ports
        self._arm: RemoteArm | None = None
        self._objects: RemoteObjects | None = None
        port = self._ports.get("--pictures")
        self.pictures = None if port is None else RemotePictures(port, note)
        """Source of the pictures that are sent to --pictures; None without it"""
        self.surfaces: Summarized | None = None
        """Source of what depth cameras see; None without any"""

    @property
    def has_arm(self) -> bool:
        """Whether --arm is given"""
        return "--arm" in self._ports

    def arm(self, shape: ArmShape, show: Callable[[ArmState], None]) -> RemoteArm:
        """Return the arm whose driver connects at --arm; arguments as for RemoteArm."""
        self._arm = RemoteArm(self._ports["--arm"], shape, show, self._note)
        return self._arm

    def objects(
        self, roles: dict[str, Role], unseen_m_s: float, prepare: Callable[[PerceivedObjects], object]
    ) -> RemoteObjects | None:
        """Return the source of objects that connects at --objects; None without it. Arguments as for RemoteObjects."""
        if (port := self._ports.get("--objects")) is not None:
            self._objects = RemoteObjects(port, roles, self._note, unseen_m_s=unseen_m_s, prepare=prepare)
        return self._objects

    def wait(self, meanwhile: Callable[[], object]) -> None:
        """Wait for the arm's first state and the first objects, however long; a signal ends the wait.

        meanwhile: called some 100 times a second.
        """
        if self.pictures is not None:
            self._note(f"pictures are taken at {self._ports['--pictures'].endpoint}")
        begin = {
            flag: part.begin if isinstance(part, RemoteArm) else part.exchange
            for flag, part in (("--arm", self._arm), ("--objects", self._objects))
            if part is not None
        }
        reported: set[str] = set()
        while waiting := [flag for flag, first in begin.items() if not first(self._ports[flag].wait(0.0))]:
            for flag in waiting:
                if flag not in reported:
                    reported.add(flag)
                    self._note(f"waiting for {_AWAITED[flag]} at {self._ports[flag].endpoint}")
            meanwhile()
            self._ports[waiting[0]].wait(_TURN_S)

    def said_limits(self) -> ArmLimits:
        """Return the limits that the arm's driver has said of its arm; none are known if it said none."""
        return (None if self._arm is None else self._arm.session.said_limits) or ArmLimits()

    def limits_taken(self) -> None:
        """Judge the arm's states by its limits as they are now."""
        if self._arm is not None:
            self._arm.session.read_limits()

    def summary(self) -> dict[str, Any]:
        """Return the numbers of accepted and rejected messages of each port; None for a port that is not used."""
        arm = None if self._arm is None else self._arm.session.summary()
        return {
            "arm": arm,
            "objects": None if self._objects is None else self._objects.summary(),
            "pictures": None if self.pictures is None else self.pictures.senders.summary(),
            "depth": None if self.surfaces is None else self.surfaces.summary(),
        }
