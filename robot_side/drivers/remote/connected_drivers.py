"""Ports of the settings --arm and --objects, and the wait for the first messages over these."""

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


class ConnectedDrivers:
    """Programs that connect: the arm's driver and the perception process, if the settings name a port for them."""

    def __init__(
        self,
        arm: str | None,
        objects: str | None,
        note: Callable[[str], None],
        *,
        insecure: bool = False,
        keys: RobotKeys | None = None,
    ) -> None:
        """Bind the ports at once; ConfigurationError as for DriverPort. note: called with lines that people read."""
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
        """Whether --arm is given"""
        return "--arm" in self._ports

    def arm(self, shape: ArmShape, show: Callable[[ArmState], None]) -> RemoteArm:
        """Return the arm whose driver connects at --arm; arguments as for RemoteArm."""
        self._arm = RemoteArm(self._ports["--arm"], shape, show, self._note)
        return self._arm

    def objects(self, roles: dict[str, Role], sd_m: float) -> RemoteObjects | None:
        """Return the source of objects that connects at --objects; None without --objects."""
        if (port := self._ports.get("--objects")) is not None:
            self._objects = RemoteObjects(port, roles, sd_m, self._note)
        return self._objects

    def wait(self) -> None:
        """Wait for the arm's first state and the first objects, however long; a signal ends the wait."""
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
                # Keys may be allowed meanwhile; the turns that refresh them have not begun.
                for text in self._ports[flag].refresh_keys():
                    self._note(text)
            self._ports[waiting[0]].wait(_TURN_S)

    def summary(self) -> dict[str, Any]:
        """Return the numbers of accepted and rejected messages of each port; None for a port that is not used."""
        arm = None if self._arm is None else self._arm.session.summary()
        return {"arm": arm, "objects": None if self._objects is None else self._objects.summary()}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()
