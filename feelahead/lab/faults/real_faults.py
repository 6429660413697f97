"""Faults of real processes on this machine: signals and cut connections. Times are this machine's."""

import signal
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from common.protocol.session import OWNING
from feelahead.both_sides.processes import SideProcess
from feelahead.lab.faults.cable import Cable
from feelahead.lab.faults.fault import Outcome, real
from feelahead.lab.faults.rig import Rig, free_ports, stands
from feelahead.lab.faults.two_machines import NotPermittedError, two_machines
from feelahead.lab.hostile.raw_zmtp import port_of
from robot_side.operators.safety import SafetySettings

T_S = SafetySettings().gap_s
_AGE_LIMIT_S = SafetySettings().age_s + SafetySettings().jitter_s
P99_S, MOST_S = T_S + 0.005, T_S + 0.020
_DECELERATION = "begins by T + 5 ms (p99), T + 20 ms (max); T = 100 ms"
_LINK_S = 1.0
_PATIENCE_S = 300.0


class Onsets:
    """When decelerations began, over many repetitions."""

    def __init__(self) -> None:
        self.slowed_s: list[float] = []
        """Times by the arm's own measurement."""
        self.disarmed_s: list[float] = []
        """Times by the robot side's clock, which needs the processor to notice."""
        self.missed = 0

    def take(self, rig: Rig, *, evenly: bool) -> dict[str, Any]:
        """Wait for one, if the arm was driven evenly, and in any case until it stands; return the counters then."""
        slowed_s, disarmed_s = rig.stop_of() if evenly else (None, None)
        if slowed_s is None or disarmed_s is None:
            self.missed += 1
            return rig.rest()
        self.slowed_s.append(slowed_s)
        self.disarmed_s.append(disarmed_s)
        return rig.rest()

    def outcome(self, *, safe: bool = True) -> Outcome:
        """Judge them: not before T; by T + 5 ms (p99) and T + 20 ms (max)."""
        if not self.slowed_s:
            return Outcome(
                safe, "the stream broke by itself each time: the machine is too busy", in_time=False, judged=not safe
            )
        in_time = min(self.slowed_s) >= T_S - 1e-3 and all(
            np.quantile(values, 0.99) <= P99_S and max(values) <= MOST_S for values in (self.slowed_s, self.disarmed_s)
        )
        measured = f"arm {_spread(self.slowed_s)}; robot side {_spread(self.disarmed_s)} ms; n = {len(self.slowed_s)}"
        if self.missed:
            measured += f", and {self.missed} in which the machine was too busy to drive evenly before"
        return Outcome(safe, measured, in_time)


@real("either side starts first", "disarmed until healthy", "link up in 1 s")
def either_side_first(_: int = 1) -> Outcome:
    """Start the operator side first, then another one that finds the robot side there."""
    control, view = free_ports(2)
    ends = [f"--connect=tcp://127.0.0.1:{control}", f"--view-connect=tcp://127.0.0.1:{view}"]
    with (
        SideProcess("feelahead.lab.faults.driver", "driver", ends) as early,
        Rig(f"tcp://127.0.0.1:{control}", [f"--view-bind=tcp://127.0.0.1:{view}"]) as rig,
    ):
        first_s = rig.until(early, "session", "disarmed", "ready")["time_s"] - rig.listening_s
        early.stop()
        rig.wait(1.0)
        late = rig.driver()
        began_s = late.wait_for("driver", _PATIENCE_S)["time_s"]
        second_s = rig.until(late, "session", "disarmed", "ready")["time_s"] - began_s
        disarmed = rig.figures()["state"] == "disarmed"
    measured = f"operator side first: {first_s:.2f} s; robot side first: {second_s:.2f} s; disarmed: {disarmed}"
    return Outcome(disarmed, measured, in_time=max(first_s, second_s) < _LINK_S)


@real("kill -9", "decelerate, hold; explicit re-arm; lease passes on", _DECELERATION, 0.15)
def killed(repeats: int) -> Outcome:
    """Kill -9 in full motion; the next driver waits already, and gets the lease."""
    onsets, safe, passed_s = Onsets(), True, []
    with Rig() as rig:
        driver = rig.driver()
        for _ in rig.rounds(repeats, 120.0):
            rig.until(driver, "session", *OWNING)
            successor = rig.driver()
            rig.until(successor, "session", "observing")
            evenly = rig.drive(driver)
            rig.lines()
            killed_s = rig.clock.now()
            rig.signal(driver, signal.SIGKILL)
            safe &= stands(onsets.take(rig, evenly=evenly))
            rig.until(successor, "session", *OWNING)
            passed_s.append(rig.owned_s[successor.process_id] - killed_s)
            safe &= stands(rig.figures())
            driver = successor
    outcome = onsets.outcome(safe=safe)
    lease = f"; lease passed on within {max(passed_s):.2f} s"
    return replace(outcome, measured=outcome.measured + lease, in_time=outcome.in_time and max(passed_s) < _LINK_S)


@real("operator stopped", "the same; its backlog moves nothing", _DECELERATION, 0.5)
def stopped(repeats: int) -> Outcome:
    """SIGSTOP of the operator side for half a second, then SIGCONT."""
    with Rig() as rig:
        driver = rig.driver()
        return _broken(
            rig,
            driver,
            repeats,
            lambda: rig.signal(driver, signal.SIGSTOP),
            lambda: rig.signal(driver, signal.SIGCONT),
            held_s=0.2,
        )


@real("half-open connection", "the same; what was held back is old", _DECELERATION, 0.25)
def cut(repeats: int) -> Outcome:
    """Let nothing through for 0.6 s and close nothing; then let all through that was held."""
    with Rig() as rig:
        ports = [port_of(rig.listening[name]) for name in ("control", "view")]
        with Cable(ports[0]) as control, Cable(ports[1]) as view:
            driver = rig.driver(f"tcp://127.0.0.1:{control.port}", f"tcp://127.0.0.1:{view.port}")
            return _broken(rig, driver, repeats, control.cut, control.mend, held_s=0.45)


@real("cable pulled (network namespaces)", "the same as kill -9; the same once it is back", _DECELERATION, 0.1)
def unplugged(repeats: int) -> Outcome:
    """Set the link between two namespaces down while the arm moves, then up again; needs root and iproute2."""
    try:
        with (
            two_machines() as (robot, operator),
            Rig(f"tcp://{robot.address}:5555", ["--insecure"], robot.surroundings) as rig,
        ):
            driver = rig.driver(before=operator.surroundings)
            return _broken(rig, driver, repeats, robot.unplug, robot.plug_in, held_s=0.5)
    except NotPermittedError as error:
        return Outcome(True, f"skipped: {error}", judged=False)


def _broken(
    rig: Rig,
    driver: SideProcess,
    repeats: int,
    break_it: Callable[[], object],
    mend: Callable[[], object],
    held_s: float,
) -> Outcome:
    """Break the stream in full motion until the arm stands, and mend it: nothing that was held back moves the arm."""
    onsets, safe, oldest_s = Onsets(), True, 0.0
    for _ in rig.rounds(repeats, 180.0):
        evenly = rig.drive(driver)
        rig.lines()
        break_it()
        told = onsets.take(rig, evenly=evenly)["told_to_move"]
        rig.wait(held_s)
        mend()
        rig.wait(0.15)
        rig.until(driver, "phase", "rest")
        figures = rig.figures()
        oldest_s = max(oldest_s, figures["oldest_accepted_s"])
        safe &= figures["told_to_move"] == told and stands(figures)
    outcome = onsets.outcome(safe=safe and oldest_s <= _AGE_LIMIT_S)
    return replace(outcome, measured=f"{outcome.measured}; oldest accepted {1e3 * oldest_s:.0f} ms")


@real("robot side stopped 2 s", "disarmed", "0 old commands applied", 0.02)
def robot_stopped(repeats: int) -> Outcome:
    """SIGSTOP of the robot side for two seconds while the operator goes on pulling, then SIGCONT."""
    applied, safe, oldest_s, in_motion = 0, True, 0.0, 0
    with Rig() as rig:
        for _ in rig.rounds(repeats, 30.0):
            driver = rig.driver()
            rig.lines()
            evenly = rig.drive(driver)
            drove_s = rig.phase(driver)["time_s"]
            rig.signal(rig.robot, signal.SIGSTOP)
            rig.wait(2.0)
            broke = any("stop" in line and line["stop"] >= drove_s for line in rig.lines())
            resumed_s = rig.clock.now()
            rig.signal(rig.robot, signal.SIGCONT)
            if evenly and not broke:
                in_motion += 1
                safe &= rig.until_line("stop")["stop"] >= resumed_s - 0.1
            rig.wait(0.3)
            figures = rig.rest()
            oldest_s = max(oldest_s, figures["oldest_accepted_s"])
            applied += figures["told_since_pause"]
            safe &= stands(figures)
            rig.end(driver)
    safe &= applied == 0 and oldest_s <= _AGE_LIMIT_S
    measured = f"{applied} old commands applied, disarmed; oldest accepted {1e3 * oldest_s:.0f} ms"
    if not in_motion:
        measured += "; the stream broke by itself each time: the machine is too busy"
    return Outcome(safe, measured, judged=in_motion > 0 or not safe)


def _spread(values_s: list[float]) -> str:
    least, middle, high, most = (1e3 * float(one) for one in np.quantile(values_s, [0.0, 0.5, 0.99, 1.0]))
    return f"{least:.1f}/{middle:.1f}/{high:.1f}/{most:.1f}"
