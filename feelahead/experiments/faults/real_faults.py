"""Faults of real processes on this machine: signals, cut connections, strangers. Times are this machine's."""

import secrets
import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from common.clock import clock_domain
from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Header, LeaseNotice, MotionCommand
from common.protocol.session import OWNING
from common.sockets.operator import OperatorSockets
from feelahead.both_sides.processes import SideProcess
from feelahead.experiments.faults.cable import Cable
from feelahead.experiments.faults.fault import Outcome
from feelahead.experiments.faults.rig import Rig, stands
from robot_side.operators.safety import SafetySettings

T_S = SafetySettings().gap_s
_AGE_LIMIT_S = SafetySettings().age_s + SafetySettings().jitter_s
_ARRIVAL_S = 30.0
P99_S, MOST_S = T_S + 0.005, T_S + 0.020

Advance = Callable[[], None]


class Onsets:
    """When decelerations began, over many repetitions."""

    def __init__(self) -> None:
        self.slowed_s: list[float] = []
        """By the arm's own measurement."""
        self.disarmed_s: list[float] = []
        """By the robot side's clock, which needs the processor to notice."""
        self.missed = 0

    def take(self, rig: Rig, *, evenly: bool) -> dict[str, Any]:
        """Wait for one, if the arm was driven evenly, and in any case until it stands; the counters then."""
        slowed_s, disarmed_s = rig.stop_of() if evenly else (None, None)
        if slowed_s is None or disarmed_s is None:
            self.missed += 1
            return rig.rest()
        self.slowed_s.append(slowed_s)
        self.disarmed_s.append(disarmed_s)
        return rig.rest()

    def outcome(self, *, safe: bool = True) -> Outcome:
        """Not before T; by T + 5 ms (p99) and T + 20 ms (max)."""
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


def killed(rig: Rig, repeats: int, advance: Advance) -> Outcome:
    """Kill -9 in full motion; the next driver waits already, and gets the lease."""
    onsets, safe = Onsets(), True
    passed_s = []
    driver = rig.driver()
    for _ in rig.rounds(repeats, advance, 120.0):
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
    _end(rig, driver)
    outcome = onsets.outcome(safe=safe)
    lease = f"; lease passed on within {max(passed_s):.2f} s"
    return replace(outcome, measured=outcome.measured + lease, in_time=outcome.in_time and max(passed_s) < 1.0)


def stopped(rig: Rig, repeats: int, advance: Advance) -> Outcome:
    """SIGSTOP of the operator side for half a second, then SIGCONT: its backlog moves nothing."""
    onsets, safe = Onsets(), True
    driver = rig.driver()
    for _ in rig.rounds(repeats, advance, 180.0):
        evenly = rig.drive(driver)
        rig.lines()
        rig.signal(driver, signal.SIGSTOP)
        told = onsets.take(rig, evenly=evenly)["told_to_move"]
        rig.wait(0.2)
        rig.signal(driver, signal.SIGCONT)
        rig.until(driver, "phase", "rest")
        figures = rig.figures()
        safe &= figures["told_to_move"] == told and stands(figures)
        safe &= figures["oldest_accepted_s"] <= _AGE_LIMIT_S
    _end(rig, driver)
    return onsets.outcome(safe=safe)


def cut(rig: Rig, repeats: int, advance: Advance) -> Outcome:
    """A connection that is half open: nothing gets through for 0.6 s, nothing is closed; then all that was held."""
    onsets, safe, oldest_s = Onsets(), True, 0.0
    ports = [urlsplit(rig.listening[name]).port or 0 for name in ("control", "view")]
    with Cable(ports[0]) as control, Cable(ports[1]) as view:
        driver = rig.driver(f"tcp://127.0.0.1:{control.port}", f"tcp://127.0.0.1:{view.port}")
        for _ in rig.rounds(repeats, advance, 120.0):
            evenly = rig.drive(driver)
            rig.lines()
            control.cut()
            told = onsets.take(rig, evenly=evenly)["told_to_move"]
            rig.wait(0.45)
            control.mend()
            rig.wait(0.15)
            rig.until(driver, "phase", "rest")
            figures = rig.figures()
            oldest_s = max(oldest_s, figures["oldest_accepted_s"])
            safe &= figures["told_to_move"] == told and stands(figures)
        _end(rig, driver)
    outcome = onsets.outcome(safe=safe and oldest_s <= _AGE_LIMIT_S)
    return replace(outcome, measured=f"{outcome.measured}; oldest accepted {1e3 * oldest_s:.0f} ms")


def robot_stopped(rig: Rig, repeats: int, advance: Advance) -> Outcome:
    """SIGSTOP of the robot side for two seconds while the operator goes on pulling, then SIGCONT."""
    applied, safe, oldest_s, in_motion = 0, True, 0.0, 0
    for _ in rig.rounds(repeats, advance, 30.0):
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
        _end(rig, driver)
    safe &= applied == 0 and oldest_s <= _AGE_LIMIT_S
    measured = f"{applied} old commands applied, disarmed; oldest accepted {1e3 * oldest_s:.0f} ms"
    if not in_motion:
        measured += "; the stream broke by itself each time: the machine is too busy"
    return Outcome(safe, measured, judged=in_motion > 0 or not safe)


def intruders(rig: Rig, repeats: int, advance: Advance) -> Outcome:
    """An observer sends what could work: no token, the owner's, and ones to come; so does somebody unknown."""
    driver = rig.driver()
    rig.drive(driver)
    before = rig.figures()
    link = LinkEnd("operator", secrets.randbits(53), clock_domain())
    sent = 0
    # What is sent is to arrive, however late: no heartbeat of a busy machine ends the connection.
    with OperatorSockets(rig.listening["control"], rig.listening["view"], heartbeat_timeout_s=60.0) as sockets:
        token = 0
        for number in range(50 * repeats):
            now_s = rig.clock.now()
            for payload in sockets.receive():
                message = decode(payload)
                link.arrived(message, now_s)
                if isinstance(message, LeaseNotice):
                    token = message.token
            if number % 20 == 0:
                sockets.send(encode(link.hello(now_s)))
            tried = (0, token, token + 1)[number % 3]
            command = MotionCommand(link.stamp(now_s), l2=1.0, r2=0.0, run=True, arm=number % 2 == 0, token=tried)
            stranger = MotionCommand(
                Header(epoch=secrets.randbits(53), sequence=number + 1, sent_s=now_s), l2=1.0, r2=0.0, token=tried
            )
            sent += sockets.send(encode(command)) + sockets.send(encode(stranger))
            rig.wait(0.004)
            if number % 50 == 49:
                advance()
        # What comes too fast for a tick is dropped unread, and counted as such.
        counters = ("commands_of_non_owners", "rejected", "unread")
        arrived_by_s = rig.clock.now() + _ARRIVAL_S
        while (
            counted := sum((figures := rig.figures())[name] - before[name] for name in counters)
        ) < sent and rig.clock.now() < arrived_by_s:
            pass
    driving = rig.phase(driver)["phase"] == "drive" and figures["state"] == "armed"
    _end(rig, driver)
    # The owner's epoch is known since it began to drive.
    applied = figures["epochs_applied"] - before["epochs_applied"]
    measured = f"{sent} sent, {counted} counted, {applied} applied; the owner drove on: {driving}"
    if figures["granted"] != before["granted"]:
        # Starved by the machine, the owner lost its lease, and the observer owns it rightly.
        return Outcome(True, "the owner fell silent by itself: the machine is too busy", in_time=False, judged=False)
    return Outcome(sent > 0 and applied == 0 and counted >= sent, measured, in_time=driving)


def storm(rig: Rig, repeats: int, advance: Advance) -> Outcome:
    """50 strangers a second connect, say Hello and go, while the owner drives."""
    driver = rig.driver()
    rig.drive(driver)
    memory_kb = resident_kb(rig.robot)
    rig.figures()
    rig.stops.clear()
    for _ in range(50 * repeats):
        began_s = rig.clock.now()
        with OperatorSockets(rig.listening["control"], rig.listening["view"]) as sockets:
            link = LinkEnd("operator", secrets.randbits(53), clock_domain())
            while not sockets.send(encode(link.hello(rig.clock.now()))) and rig.clock.now() - began_s < 0.1:
                rig.wait(0.001)
            rig.wait(max(0.0, began_s + 0.02 - rig.clock.now()))
        advance()
    grown_kb = resident_kb(rig.robot) - memory_kb
    driving = rig.phase(driver)["phase"] == "drive" and rig.figures()["state"] == "armed"
    stops = "; ".join(rig.stops)
    _end(rig, driver)
    measured = f"stops while it drove: {stops or 'none'}; memory grew by {grown_kb / 1024:.1f} MB"
    return Outcome(grown_kb < 10 * 1024, measured, in_time=driving)


def resident_kb(process: SideProcess) -> int:
    """Its resident memory."""
    for line in Path(f"/proc/{process.process_id}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    raise ValueError(f"process {process.process_id} tells no VmRSS; valid: a running process on Linux")


def _end(rig: Rig, driver: SideProcess) -> None:
    """End a driver and wait until its lease has, too."""
    driver.stop()
    deadline_s = rig.clock.now() + 3.0
    while rig.figures()["state"] == "armed" and rig.clock.now() < deadline_s:
        rig.wait(0.05)
    rig.wait(SafetySettings().lease_s)


def _spread(values_s: list[float]) -> str:
    least, middle, high, most = (1e3 * float(one) for one in np.quantile(values_s, [0.0, 0.5, 0.99, 1.0]))
    return f"{least:.1f}/{middle:.1f}/{high:.1f}/{most:.1f}"
