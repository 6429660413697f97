"""Either side first: how long after the robot side listens the operator side stands where it should."""

import contextlib
import secrets
import socket

from feelahead.both_sides.processes import SideProcess
from feelahead.experiments.faults.fault import Outcome
from feelahead.experiments.faults.rig import Rig

_LIMIT_S = 1.0
_PATIENCE_S = 300.0


def either_side_first() -> Outcome:
    """The operator side first, then another one that finds the robot side there."""
    control, view = free_ports(2)
    endpoints = [f"--connect=tcp://127.0.0.1:{control}", f"--view-connect=tcp://127.0.0.1:{view}"]
    with (
        SideProcess("feelahead.experiments.faults.driver", "driver", endpoints) as early,
        Rig(f"tcp://127.0.0.1:{control}", [f"--view-bind=tcp://127.0.0.1:{view}"]) as rig,
    ):
        first = rig.until(early, "session", "disarmed", "ready")
        first_s = first["time_s"] - rig.listening_s
        early.stop()
        rig.wait(1.0)
        late = rig.driver()
        began_s = late.wait_for("driver", _PATIENCE_S)["time_s"]
        second_s = rig.until(late, "session", "disarmed", "ready")["time_s"] - began_s
        disarmed = rig.figures()["state"] == "disarmed"
    measured = f"operator side first: {first_s:.2f} s; robot side first: {second_s:.2f} s; disarmed: {disarmed}"
    return Outcome(disarmed, measured, in_time=max(first_s, second_s) < _LIMIT_S)


def free_ports(count: int) -> list[int]:
    """Ports for later: below those that Linux hands out by itself (32768 and up), so that nobody gets one meanwhile."""
    ports: list[int] = []
    for port in secrets.SystemRandom().sample(range(20_000, 30_000), 1000):
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            ports.append(port)
        if len(ports) == count:
            break
    return ports
