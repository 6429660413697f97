"""Faults of who sends and of what is sent, in virtual time."""

import itertools
import math
from collections.abc import Iterator
from typing import Any
from unittest import mock

import msgpack
import numpy as np

from common.protocol.codec import decode, encode
from common.protocol.session import SessionState
from feelahead.lab.faults.fault import Outcome, fault
from feelahead.lab.faults.session_bench import CRUISE, QUICK, TICK_S, Operator, cruising
from robot_side.operators.lease import MOST_AWAY, MOST_OBSERVERS

_LEASE_S = QUICK.safety.lease_s
_HOUR_S = 3600.0
_WALL_CLOCK_S = 1.8e9


@fault("operator restarts")
def operator_restarts() -> Outcome:
    """Killed in full motion; its successor pulls R2 from the start, over the same connection."""
    bench, old = cruising()
    before = np.array([speed for _, speed in bench.watch.speeds_rad_s])
    largest_step = float(np.abs(np.diff(before)).max())
    new = bench.join(3)
    disarmed = bench.state == "disarmed"
    start = len(bench.watch.speeds_rad_s)
    bench.drive(0.5, new, r2=1.0)
    # What the old one had sent comes late.
    bench.send(old, r2=1.0)
    bench.tick(5)
    after = np.array([speed for _, speed in bench.watch.speeds_rad_s[start:]])
    moved = 3 in bench.moved_by or float(after[50:].max()) > 0.005
    step = float(np.abs(np.diff(after)).max())
    bench.say_hello(old)
    returned = bench.robot.session.lease.find(2) is not None
    bench.cruise(new)
    limit = 12.0 * TICK_S * 1.05  # the arm's deceleration limit in one tick
    safe = disarmed and not moved and not returned and step <= max(limit, largest_step)
    return Outcome(safe, f"disarmed, moved by the new epoch: {moved}; largest change of speed {step:.4f} rad/s a tick")


@fault("two operators")
def two_operators() -> Outcome:
    """The second one sends whatever could work: no token, the owner's, tokens to come; and stops, and presses."""
    bench, owner = cruising()
    other = bench.join(3, b"other")
    for step in range(400):
        bench.tick()
        if step % 4 == 0:
            bench.send(owner, r2=CRUISE)
            bench.send(other, l2=1.0, token=(0, owner.token, owner.token + 1)[step // 4 % 3], emergency_stop=step > 300)
    intruded = bench.moved_by - {2}
    armed = bench.state == "armed" and other.state is SessionState.OBSERVING
    counted = bench.robot.session.not_owners
    # The owner dies; the observer says Hello every 200 ms.
    died_s = bench.now_s
    while other.state is SessionState.OBSERVING and bench.now_s - died_s < 3.0:
        bench.tick()
        if bench.ticks % 200 == 0:
            bench.say_hello(other)
    passed_s = bench.now_s - died_s
    bench.drive(0.3, other, l2=CRUISE)
    still = 3 not in bench.moved_by
    # What the old owner sends under its old token is nobody's command.
    bench.send(owner, r2=1.0, arm=True)
    bench.arm_it(other)
    bench.drive(0.1, other, l2=CRUISE)
    safe = not intruded and armed and counted == 100 and passed_s < 1.0 and still and bench.moved_by == {2, 3}
    return Outcome(
        safe, f"{len(intruded)} commands of a non-owner, {counted} counted; lease passed after {passed_s:.3f} s"
    )


@fault("wall clock jumps an hour")
def wall_clock_jumps() -> Outcome:
    """The wall clock runs an hour ahead, then an hour back, in the middle of the motion."""
    traces = []
    for jump_s in (0.0, _HOUR_S, -_HOUR_S):
        bench, operator = cruising()
        shown_s = _WALL_CLOCK_S + jump_s
        with mock.patch("time.time", lambda shown_s=shown_s: shown_s):
            bench.drive(0.2, operator, r2=CRUISE)
        traces.append((list(bench.watch.speeds_rad_s), list(bench.robot.session.safety.stops), bench.state))
    alike = traces[0] == traces[1] == traces[2]
    trips = sum(len(stops) for _, stops, _ in traces)
    return Outcome(
        alike and trips == 0 and traces[0][2] == "armed", f"{trips} trips, the same motion to the last bit: {alike}"
    )


@fault("NaN, inf, wrong size, out of range")
def bad_messages() -> Outcome:
    """A good command with one part replaced, as it would come over the wire."""
    bench, operator = cruising()
    before = bench.robot.session.rejected
    accepted = set(bench.applied)
    spoilt = list(_spoilt_parts())
    for number, (place, value) in enumerate(spoilt):
        bench.robot.receive(operator.peer, _spoil(operator.command(bench.now_s, r2=1.0), place, value), bench.now_s)
        bench.tick()
        if number % 4 == 0:
            accepted.add(decode(bench.send(operator, r2=CRUISE)).header.sequence)
    refused = bench.robot.session.rejected - before
    reached = len(set(bench.applied) - accepted) + bench.watch.not_finite
    safe = refused == len(spoilt) and reached == 0 and bench.state == "armed"
    return Outcome(safe, f"{len(spoilt)} sent, {refused} rejected, {reached} reached the controller")


def _spoilt_parts() -> Iterator[tuple[tuple[int, ...], Any]]:
    """(where in the message, what stands there instead); () is the whole."""
    infinite = [math.nan, math.inf, -math.inf]
    bad: list[tuple[list[tuple[int, ...]], list[Any]]] = [
        ([(2,), (3,), (6,), (4, 0), (5, 1)], [*infinite, 1.01, -1.01, "1", None, [], 1 << 60]),
        ([(4,), (5,)], [[0.0], [0.0] * 3, "no", 0.5]),
        ([(7,), (8,), (9,), (10,), (11,)], [1, 0.0, "true", None]),
        ([(12,)], [-1, 0.5, 1 << 63, "1"]),
        ([(13,)], ["nobody", "", 1, None, []]),
        ([(1, 2)], [*infinite, "0", None]),
        ([(1, 1)], [-1, 0.5, None, 1 << 63]),
        ([(1, 4)], [*infinite, -1.0]),
    ]
    for places, values in bad:
        yield from itertools.product(places, values)
    for length in (1, 2, 3, 15, 40):
        yield (), length


def _spoil(payload: bytes, place: tuple[int, ...], value: Any) -> bytes:
    version, content = msgpack.unpackb(payload)
    if not place:
        content = (content + [0.0] * value)[:value]
    else:
        part = content
        for index in place[:-1]:
            part = part[index]
        part[place[-1]] = value
    return bytes(msgpack.packb([version, content]))


@fault("emergency stop")
def emergency_stop() -> Outcome:
    """Pressed once in full motion; the operator goes on pulling, leaves, and another one comes."""
    bench, operator = cruising()
    bench.send(operator, r2=CRUISE, emergency_stop=True)
    told = bench.watch.told_to_move
    bench.drive(0.5, operator, r2=CRUISE)
    stopped = bench.state == "stopped" and bench.watch.told_to_move == told and bench.speed_rad_s < 0.005
    bench.silence(1.0)
    other = bench.join(3, b"other")
    latched = bench.state == "stopped" and other.state is SessionState.STOPPED
    bench.drive(0.3, other, r2=CRUISE)
    latched &= bench.state == "stopped" and bench.watch.told_to_move == told
    bench.cruise(other)
    return Outcome(stopped and latched, "stopped at once; latched until the next operator armed")


@fault("reconnect storm, 50/s")
def reconnect_storm() -> Outcome:
    """50 strangers a second for four seconds, each with another epoch, while the owner drives."""
    bench, operator = cruising()
    known = 0
    for step in range(4000):
        bench.tick()
        if step % 4 == 0:
            bench.send(operator, r2=CRUISE if step // 500 % 2 == 0 else 0.0, l2=0.0 if step // 500 % 2 == 0 else CRUISE)
        if step % 20 == 0:
            stranger = Operator(1000 + step, b"stranger %d" % step)
            bench.robot.receive(stranger.peer, stranger.command(bench.now_s), bench.now_s)
            bench.robot.receive(stranger.peer, encode(stranger.link.hello(bench.now_s)), bench.now_s)
        known = max(known, sum(1 for _ in bench.robot.session.lease.known()))
    most = 1 + MOST_OBSERVERS + MOST_AWAY
    safe = bench.state == "armed" and not bench.robot.session.safety.stops and bench.moved_by == {2} and known <= most
    return Outcome(safe, f"no stop; at most {known} operators known at a time, {bench.robot.session.refused} refused")
