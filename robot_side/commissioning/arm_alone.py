"""Arm without operators: its driver's port alone is bound, or it is simulated. For what is done before they drive."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from select import select
from typing import Final

from common.clock import clock_domain
from common.command.stop_signal import StopSignal
from common.sockets.door.client import Door, DriverPort
from common.sockets.door.messages import DoorSettings
from robot_side.arm.limits import ArmLimits
from robot_side.arm.port import Arm
from robot_side.commissioning.limits_measurement import KnownLimits
from robot_side.commissioning.procedure import PERIOD_S, Pace, StoppedError, VirtualPace
from robot_side.depth.camera_settings import DEPTH_PORT
from robot_side.drivers.mujoco.robot_model import joint_names
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.connected_drivers import ConnectedDrivers, driver_ports
from robot_side.parts import SceneParts, build_parts, take_limits
from robot_side.settings import RobotSettings

_LOOK_S: Final = 0.02


class DoorPace:
    """Real time, in which the driver's messages are taken as they come."""

    def __init__(self, door: Door, arm: RemoteArm | None, stop: StopSignal) -> None:
        """arm: None if it is not driven."""
        self._door, self._arm, self._stop = door, arm, stop
        self._due_s = door.clock.now()

    @property
    def stopped(self) -> bool:
        """Whether a stop signal came."""
        return self._stop.is_set

    def wait(self) -> float:
        """Wait for the next period; periods that are missed are left out."""
        clock = self._door.clock
        self._due_s = max(self._due_s + PERIOD_S, clock.now())
        while (left_s := self._due_s - clock.now()) > 0.0:
            self._door.wait(left_s)
            if self._arm is not None:
                self._arm.exchange(clock.now())
        return clock.now()


@dataclass(frozen=True)
class ArmAlone:
    """Arm, what is known of it, and the pace at which it may be moved."""

    arm: Arm
    parts: SceneParts
    settings: RobotSettings
    known: KnownLimits
    joint_names: tuple[str, ...]
    pace: Pace
    simulated: bool
    aside: bool = False
    """Whether questions go to standard error"""
    depth: DriverPort | None = None
    """Port at which depth pictures arrive"""

    def answer(self, question: str) -> str:
        """Ask a person, and return the answer in small letters; meanwhile the arm is commanded nothing.

        "" at the end of the input. StoppedError if a stop signal comes.
        """
        stream = sys.stderr if self.aside else sys.stdout
        stream.write(f"{question} ")
        stream.flush()
        while not select([sys.stdin], [], [], _LOOK_S)[0]:
            if self.pace.stopped:
                raise StoppedError("ended by a person: nothing was moved since the last line")
            self.arm.state(self.pace.wait())
        return sys.stdin.readline().strip().lower()


@contextmanager
def arm_alone(settings: RobotSettings, say: Callable[[str], None], *, with_depth: bool = False) -> Iterator[ArmAlone]:
    """Make the arm of the settings, and wait for its driver's first state; a stop signal ends the wait.

    with_depth: also bind the port of depth pictures, if there is one; time is real then, also for a simulated arm.

    ConfigurationError for settings that cannot be used; StoppedError if a stop signal ends the wait.
    """
    keys = None if settings.keys is None else str(settings.keys)
    ports = driver_ports(settings.arm, None, depth=settings.depth if with_depth else None)
    with ExitStack() as stack:
        stop = stack.enter_context(StopSignal())
        door = stack.enter_context(
            Door(DoorSettings(settings.bind, None, ports, insecure=settings.insecure, keys=keys), say)
        )
        drivers = ConnectedDrivers(door, say)
        parts = build_parts(settings, 0, clock_domain(), announce=say, drivers=drivers)
        arm, said = parts.arm, ArmLimits()
        pace: Pace = DoorPace(door, None, stop) if with_depth else VirtualPace()
        if ports:
            door.ready()
        if isinstance(arm, RemoteArm):

            def go_on() -> None:
                if stop.is_set:
                    raise StoppedError("ended by a person before the driver sent a state")

            drivers.wait(go_on)
            said = drivers.said_limits() or said
            say(take_limits(settings, parts, drivers)[1])
            pace = DoorPace(door, arm, stop)
        known = KnownLimits(parts.limits, settings.arm_limits, said)
        names = joint_names(parts.scene)[0]
        depth, simulated = door.ports.get(DEPTH_PORT), settings.arm is None
        yield ArmAlone(arm, parts, settings, known, names, pace, simulated, depth=depth)
