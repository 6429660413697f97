"""An operator side whose hands obey signals: the process that faults are tried on.

    SIGUSR1    rest, arm, then hold R2 and L2 evenly, for a second each in turn
    SIGTERM    end

The core, its bytes and the sockets are those of feelahead-operator; only the controller is missing. Lines of JSON
say the phase of the hands and the state of the session.
"""

import secrets
import signal
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import tyro

from common.clock import MonotonicClock, clock_domain
from common.command.command_line import parse_settings, run_command
from common.command.status import Status, StatusMode
from common.command.stop_signal import StopSignal
from common.protocol.session import OWNING
from common.realtime.priority import raise_priority
from common.sockets.operator import OperatorSockets
from operator_side.core import OperatorSide
from operator_side.dualsense.reports.controller_state import Button, ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from operator_side.main import MOTION_PERIOD_S

PROGRAM = "feelahead.lab.faults.driver"
_TRAVEL = 0.42
"""Raw travel: 0.1 m/s of the built-in arm."""
_PRESS_S = 0.05
_REVERSES_S = 1.0


@dataclass(frozen=True)
class DriverSettings:
    """An operator side whose hands obey signals."""

    connect: Annotated[str, tyro.conf.arg(metavar="tcp://HOST:PORT")] = "tcp://127.0.0.1:5555"
    """Address of the robot side."""
    view_connect: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address at which it publishes views."""
    healthy_ms: float = 200.0
    """Rest before arming."""
    backward: bool = False
    """Begin with L2 instead of R2; then the other way each time."""
    status: StatusMode = "json"
    """JSON lines for programs."""


class Hands:
    """Rest, arm, drive, in turn."""

    def __init__(self, healthy_s: float, *, backward: bool) -> None:
        self.phase = "rest"
        self._healthy_s = healthy_s
        self._since_s = 0.0
        self._forward = backward

    def drive(self, now_s: float) -> None:
        """Rest once more, arm and drive, the other way round."""
        self._forward = not self._forward
        self._to("wait", now_s)

    def tick(self, now_s: float, *, owns: bool, armed: bool) -> ControllerState:
        """Move the hands on; give the controller's state."""
        elapsed_s = now_s - self._since_s
        if self.phase == "wait" and not owns:
            self._to("wait", now_s)
        elif self.phase == "wait" and elapsed_s > self._healthy_s + _PRESS_S:
            self._to("press", now_s)
        elif self.phase == "press" and armed:
            self._to("drive", now_s)
        elif self.phase == "press" and elapsed_s > 1.0:
            self._to("wait", now_s)
        elif self.phase == "drive" and not armed:
            self._to("rest", now_s)
        pressed = {Button.L1}
        if self.phase == "press" and now_s - self._since_s < _PRESS_S:
            pressed.add(Button.OPTIONS)
        travel = _TRAVEL if self.phase == "drive" else 0.0
        forward = self._forward == (int((now_s - self._since_s) / _REVERSES_S) % 2 == 0)
        return ControllerState(l2=0.0 if forward else travel, r2=travel if forward else 0.0, pressed=frozenset(pressed))

    def _to(self, phase: str, now_s: float) -> None:
        self.phase, self._since_s = phase, now_s


def command(arguments: Sequence[str]) -> int:
    """Obey until SIGTERM."""
    settings = parse_settings(DriverSettings, PROGRAM, arguments)
    clock = MonotonicClock()
    hands = Hands(1e-3 * settings.healthy_ms, backward=settings.backward)
    signal.signal(signal.SIGUSR1, lambda *_: hands.drive(clock.now()))
    core = OperatorSide(secrets.randbits(53), clock_domain(), haptics=False)
    said: tuple[str, str] | None = None
    next_motion_s = clock.now()
    with (
        OperatorSockets(settings.connect, settings.view_connect) as sockets,
        StopSignal() as stop,
        Status(settings.status, "driver") as status,
    ):
        raise_priority()
        while not stop.is_set:
            now_s = clock.now()
            for payload in sockets.receive():
                core.receive(payload, now_s)
            for _, payload in sockets.receive_view():
                core.receive_view(payload, now_s)
            core.output_report(now_s)
            if now_s >= next_motion_s:
                next_motion_s = max(next_motion_s + MOTION_PERIOD_S, now_s)
                owns = core.lease is not None and core.lease.session in OWNING
                armed = core.stiffness is not None and core.stiffness.state == "armed" and owns
                core.read_report(build_input_report(hands.tick(now_s, owns=owns, armed=armed)), now_s)
                for payload in core.motion(now_s):
                    sockets.send(payload)
                says = (hands.phase, "none" if core.lease is None else str(core.lease.session))
                if says != said:
                    said = says
                    status.event("driver", phase=says[0], session=says[1], time_s=now_s)
                status.show(now_s, core.status(now_s))
            sockets.wait(max(0.0, next_motion_s - clock.now()))
    return 0


if __name__ == "__main__":
    run_command(PROGRAM, command)
