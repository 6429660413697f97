"""Viewers that subscribe and then never read: they must lose what they do not take, alone."""

import contextlib
import socket
from collections.abc import Callable
from urllib.parse import urlsplit

import numpy as np

from feelahead.experiments.faults.fault import Outcome
from feelahead.experiments.faults.rig import Rig, stands

_VIEWERS = 20
_WINDOW_S = 3.0
_TICKED_WINDOWS = 5
"""Tenths of a second that must have been counted, however slowly a busy machine does so."""
_MOST_CHANGE = 0.10

# A subscriber's part of the handshake without security, as ZMTP 3.0 (rfc.zeromq.org/spec/23) lays it down.
_GREETING = b"\xff" + bytes(8) + b"\x7f" + b"\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)
_READY_BODY = b"\x05READY" + b"\x0bSocket-Type" + (3).to_bytes(4, "big") + b"SUB"
_READY = b"\x04" + bytes([len(_READY_BODY)]) + _READY_BODY
_SUBSCRIBE_TO_ALL = b"\x00\x01\x01"


def slow_viewer(rig: Rig, repeats: int, advance: Callable[[], None]) -> Outcome:
    """Twenty of them, while the owner drives; the ticks before and meanwhile, in turn."""
    driver = rig.driver()
    rig.drive(driver)
    alone_us: list[float] = []
    watched_us: list[float] = []
    rig.figures()
    rig.stops.clear()
    for _ in rig.rounds(repeats, advance, 25.0):
        alone_us += _ticks_us(rig)
        with contextlib.ExitStack() as viewers:
            for _ in range(_VIEWERS):
                viewers.enter_context(_deaf_subscriber(urlsplit(rig.listening["view"]).port or 0))
            watched_us += _ticks_us(rig)
    driving = rig.phase(driver)["phase"] == "drive" and rig.figures()["state"] == "armed"
    stops = "; ".join(rig.stops) or "none"
    driver.stop()
    rested = stands(rig.rest())
    before_us, during_us = float(np.median(alone_us)), float(np.median(watched_us))
    change = during_us / before_us - 1.0
    measured = (
        f"tick p99 {before_us:.0f} us alone, {during_us:.0f} us with {_VIEWERS} of them ({100.0 * change:+.0f} %)"
    )
    # A stop is safe, whatever broke the stream; to be deaf to the owner's silence would not be.
    in_time = driving and stops == "none" and change < _MOST_CHANGE
    return Outcome(rested, f"{measured}; stops: {stops}", in_time)


def _ticks_us(rig: Rig) -> list[float]:
    """The p99 of each tenth of a second in a window."""
    rig.lines()
    rig.wait(_WINDOW_S)
    ticks_us = [line["figures"]["tick_p99_us"] for line in rig.lines() if "figures" in line]
    while len(ticks_us) < _TICKED_WINDOWS:
        ticks_us.append(rig.figures()["tick_p99_us"])
    return ticks_us


def _deaf_subscriber(port: int) -> socket.socket:
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    connection.settimeout(60.0)
    connection.connect(("127.0.0.1", port))
    connection.sendall(_GREETING)
    received = 0
    while received < len(_GREETING):
        received += len(connection.recv(len(_GREETING) - received))
    connection.sendall(_READY + _SUBSCRIBE_TO_ALL)
    return connection
