"""The ports that --arm and --objects open, and the wait for the first that comes over them."""

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final, Self

from common.roles import Role
from common.sockets.authentication import RobotKeys
from common.sockets.driver_port import DriverPort
from robot_side.arm.port import ArmState
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.driver_session import ArmShape
from robot_side.drivers.remote.frame_message import FRAME_LIMIT_BYTES
from robot_side.drivers.remote.messages import STATE_LIMIT_BYTES
from robot_side.drivers.remote.objects import RemoteObjects

_TURN_S: Final = 0.004
_AWAITED: Final = {"--arm": "an arm's driver", "--objects": "a process that perceives objects"}


class Beside:
    """What runs beside the robot side, as far as its settings name it: a driver, a process that perceives."""

    def __init__(
        self,
        arm: str | None,
        objects: str | None,
        note: Callable[[str], None],
        *,
        insecure: bool = False,
        keys: RobotKeys | None = None,
    ) -> None:
        """Bind at once; ConfigurationError as for DriverPort. note: told what people should know."""
        self._note = note
        with ExitStack() as opened:
            ports = [
                (flag, text, opened.enter_context(DriverPort(text, flag, limit, insecure=insecure, keys=keys)))
                for flag, text, limit in (
                    ("--arm", arm, STATE_LIMIT_BYTES),
                    ("--objects", objects, FRAME_LIMIT_BYTES),
                )
                if text is not None
            ]
            self._ports = {flag: port for flag, _, port in ports}
            self._open = opened.pop_all()
        self._arm: RemoteArm | None = None
        self._objects: RemoteObjects | None = None

    @property
    def has_arm(self) -> bool:
        """Whether there is --arm."""
        return "--arm" in self._ports

    def arm(self, shape: ArmShape, show: Callable[[ArmState], None]) -> RemoteArm:
        """The arm behind --arm; arguments as RemoteArm's."""
        self._arm = RemoteArm(self._ports["--arm"], shape, show, self._note)
        return self._arm

    def objects(self, roles: dict[str, Role], sd_m: float) -> RemoteObjects | None:
        """The objects behind --objects; None without."""
        if (port := self._ports.get("--objects")) is not None:
            self._objects = RemoteObjects(port, roles, sd_m, self._note)
        return self._objects

    def wait(self) -> None:
        """Wait until the arm has said where it is, and objects have been seen; a signal has to end it."""
        begin = {
            flag: part.begin if isinstance(part, RemoteArm) else part.exchange
            for flag, part in (("--arm", self._arm), ("--objects", self._objects))
            if part is not None
        }
        told: set[str] = set()
        while waiting := [flag for flag, first in begin.items() if not first(self._ports[flag].wait(0.0))]:
            for flag in waiting:
                if flag not in told:
                    told.add(flag)
                    self._note(f"waiting for {_AWAITED[flag]} at {self._ports[flag].endpoint}")
                # Keys may be allowed meanwhile; nobody else looks at them yet.
                for text in self._ports[flag].refresh_keys():
                    self._note(text)
            self._ports[waiting[0]].wait(_TURN_S)

    def summary(self) -> dict[str, Any]:
        """What came over each port and what of it was rejected; None for what is not asked for."""
        arm = None if self._arm is None else self._arm.session.summary()
        return {"arm": arm, "objects": None if self._objects is None else self._objects.summary()}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()
