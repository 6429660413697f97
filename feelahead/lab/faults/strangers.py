"""Faults of others at the port of a real robot side: intruders, viewers that never read, a storm of strangers."""

import secrets
from contextlib import ExitStack, closing
from typing import Any

import numpy as np

from common.clock import clock_domain
from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Header, LeaseNotice, MotionCommand
from common.sockets.operator import OperatorSockets
from feelahead.both_sides.memory import resident_mb
from feelahead.lab.faults.fault import Outcome, real
from feelahead.lab.faults.rig import Rig, stands
from feelahead.lab.hostile.raw_zmtp import RawConnection, message, port_of

_ARRIVAL_S = 30.0
_VIEWERS = 20
_WINDOW_S = 3.0
_WINDOW_TICKED = 5
"""Status lines that must have come in a window, however slowly a busy machine sends them."""
_MOST_CHANGE = 0.10
_PATIENCE_S = 300.0
_MOST_MB = 10.0
_STRANGERS_A_ROUND = 50


@real("two operators, a stranger", "a lease; others observe", "0 of their commands applied", 0.04)
def intruders(repeats: int) -> Outcome:
    """Let an observer send what could work: no token, the owner's, and ones to come; and a stranger, too."""
    link = LinkEnd("operator", secrets.randbits(53), clock_domain())
    sent = token = 0
    # What is sent is to arrive, however late: no heartbeat of a busy machine ends the connection.
    with (
        Rig() as rig,
        OperatorSockets(rig.listening["control"], rig.listening["view"], heartbeat_timeout_s=60.0) as ours,
    ):
        driver = rig.driver()
        rig.drive(driver)
        before = rig.figures()
        for number in range(_STRANGERS_A_ROUND * repeats):
            now_s = rig.clock.now()
            for payload in ours.receive():
                received = decode(payload)
                link.arrived(received, now_s)
                if isinstance(received, LeaseNotice):
                    token = received.token
            if number % 20 == 0:
                ours.send(encode(link.hello(now_s)))
            tried = (0, token, token + 1)[number % 3]
            command = MotionCommand(link.stamp(now_s), l2=1.0, r2=0.0, run=True, arm=number % 2 == 0, token=tried)
            header = Header(epoch=secrets.randbits(53), sequence=number + 1, sent_s=now_s)
            stranger = MotionCommand(header, l2=1.0, r2=0.0, token=tried)
            sent += ours.send(encode(command)) + ours.send(encode(stranger))
            rig.wait(0.004)
        counted = _all_counted(rig, before, sent)
        figures = rig.figures()
        driving = rig.phase(driver)["phase"] == "drive" and figures["state"] == "armed"
        # A command that comes too fast for a tick is dropped unread, and counted as such.
        counted += rig.summary()["strangers"]["unread"]
    # The owner's epoch is known since it began to drive.
    applied = figures["epochs_applied"] - before["epochs_applied"]
    measured = f"{sent} sent, {counted} counted, {applied} applied; the owner drove on: {driving}"
    if figures["granted"] != before["granted"]:
        # Starved by the machine, the owner lost its lease, and the observer owns it rightly.
        return Outcome(True, "the owner fell silent by itself: the machine is too busy", in_time=False, judged=False)
    return Outcome(sent > 0 and applied == 0 and counted >= sent, measured, in_time=driving)


def _all_counted(rig: Rig, before: dict[str, Any], sent: int) -> int:
    """Wait until all was counted, or until nothing more is; return the number."""
    counted, newest_s = -1, rig.clock.now()
    while counted < sent and rig.clock.now() < newest_s + _ARRIVAL_S:
        figures = rig.figures()
        found = sum(figures[name] - before[name] for name in ("commands_of_non_owners", "rejected"))
        if found > counted:
            counted, newest_s = found, rig.clock.now()
    return counted


@real("slow viewers", "lose frames, alone", "tick p99 changes by < 10 %", 0.03)
def slow_viewer(repeats: int) -> Outcome:
    """Let twenty subscribe and never read while the owner drives; compare the ticks before and meanwhile, in turn."""
    alone_us: list[float] = []
    watched_us: list[float] = []
    with Rig() as rig:
        driver = rig.driver()
        rig.drive(driver)
        rig.figures()
        rig.stops.clear()
        for _ in rig.rounds(repeats, 25.0):
            alone_us += _ticks_us(rig)
            with ExitStack() as viewers:
                for _ in range(_VIEWERS):
                    viewer = RawConnection.introduced(port_of(rig.listening["view"]), b"SUB", buffer_bytes=2048)
                    viewers.enter_context(closing(viewer)).send(message(b"\x01"))
                watched_us += _ticks_us(rig)
        driving = rig.phase(driver)["phase"] == "drive" and rig.figures()["state"] == "armed"
        stops = "; ".join(rig.stops) or "none"
        driver.stop()
        rested = stands(rig.rest())
    before_us, during_us = float(np.median(alone_us)), float(np.median(watched_us))
    change = during_us / before_us - 1.0
    measured = f"tick p99 {before_us:.0f} us alone, {during_us:.0f} us with {_VIEWERS} ({100.0 * change:+.0f} %)"
    # A stop is safe, whatever broke the stream; to be deaf to the owner's silence would not be.
    in_time = driving and stops == "none" and change < _MOST_CHANGE
    return Outcome(rested, f"{measured}; stops: {stops}", in_time)


def _ticks_us(rig: Rig) -> list[float]:
    """Return the p99 of the ticks before each status line in a window."""
    rig.robot.events()
    rig.wait(_WINDOW_S)
    lines = [event for event in rig.robot.events() if event["event"] == "status"]
    while len(lines) < _WINDOW_TICKED:
        lines.append(rig.robot.wait_for("status", _PATIENCE_S))
    return [line["tick_p99_us"] for line in lines]


@real("reconnect storm, 50/s", "control unaffected", "no stop, memory growth < 10 MB", 0.05)
def storm(repeats: int) -> Outcome:
    """Let 50 strangers a second connect, say Hello and go, while the owner drives."""
    with Rig() as rig:
        driver = rig.driver()
        rig.drive(driver)
        before_mb = resident_mb(rig.robot.process_id)
        rig.figures()
        rig.stops.clear()
        for _ in range(_STRANGERS_A_ROUND * repeats):
            began_s = rig.clock.now()
            with OperatorSockets(rig.listening["control"], rig.listening["view"]) as sockets:
                link = LinkEnd("operator", secrets.randbits(53), clock_domain())
                while not sockets.send(encode(link.hello(rig.clock.now()))) and rig.clock.now() - began_s < 0.1:
                    rig.wait(0.001)
                rig.wait(max(0.0, began_s + 0.02 - rig.clock.now()))
        grown_mb = resident_mb(rig.robot.process_id) - before_mb
        driving = rig.phase(driver)["phase"] == "drive" and rig.figures()["state"] == "armed"
        stops = "; ".join(rig.stops) or "none"
    measured = f"stops while it drove: {stops}; memory grew by {grown_mb:.1f} MB"
    return Outcome(grown_mb < _MOST_MB, measured, in_time=driving)
