"""Pairs of processes that send to each other in turns: what share of a core each kind takes, beside bare sockets."""

import multiprocessing
import signal
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Final, Literal

import numpy as np

from common.clock import MonotonicClock
from common.realtime.priority import raise_priority
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from feelahead.benchmarks.link.ends import BYTES, BareEnd, End, OperatorEnd, RobotEnd
from feelahead.benchmarks.link.peers import BareZeroMQLink, DatagramLink, RobotLink
from feelahead.benchmarks.link.real import cpu_s

Kind = Literal["whole ends", "their sockets", "bare ZeroMQ", "bare UDP"]
KINDS: Final[tuple[Kind, ...]] = ("whole ends", "their sockets", "bare ZeroMQ", "bare UDP")
"""With protocol, session, pacing and an emulated link without delay; the same sockets alone; none of ours."""
OURS: Final[tuple[Kind, ...]] = ("whole ends", "their sockets")
_PATIENCE_S: Final = 60.0
_SETTLING_S: Final = 0.4
"""Before each turn is measured: sessions that fell asleep are there again."""


@dataclass(frozen=True)
class Share:
    """Of one core, with all threads, in one turn of one kind."""

    robot: float
    operator: float
    sent_per_s: float
    """By each end, the mean of both."""

    @property
    def both(self) -> float:
        """Of one core, both processes together."""
        return self.robot + self.operator


def take_turns(
    seconds: float, turns: int, period_s: float, waiting: Callable[[float], object]
) -> dict[Kind, list[Share]]:
    """Let each kind send for `seconds` in each of the turns; `waiting` hears how many seconds have passed.

    TimeoutError when an end does not report.
    """
    clock = MonotonicClock()
    found: dict[Kind, list[Share]] = {kind: [] for kind in KINDS}
    pairs = {kind: _start(kind) for kind in KINDS}
    try:
        for _ in range(turns):
            for kind, ends in pairs.items():
                start_s = clock.now()
                for place, end in enumerate(ends):
                    # Half a period apart, so that no kind finds deadlines and messages at the same instant by chance.
                    first_s = start_s + 0.5 * place * period_s
                    end.send((first_s, start_s + _SETTLING_S, start_s + _SETTLING_S + seconds, period_s))
                (robot, sent), (operator, sent_back) = (_heard(end, _SETTLING_S + seconds) for end in ends)
                found[kind].append(Share(robot, operator, 0.5 * (sent + sent_back)))
                waiting(clock.now() - start_s)
    finally:
        for ends in pairs.values():
            for end in ends:
                end.close()  # which ends its process
    return found


def ratio(found: Sequence[Share], peer: Sequence[Share]) -> float:
    """The median over the turns, each beside the peer's of the same turn: the machine's speed varies."""
    return float(np.median([one.both / other.both for one, other in zip(found, peer, strict=True)]))


def _start(kind: Kind) -> tuple[Connection, Connection]:
    context = multiprocessing.get_context("spawn")
    pipes = [context.Pipe() for _ in range(2)]
    address: Any = None
    for place, (ours, theirs) in enumerate(pipes):
        context.Process(target=_serve, args=(kind, place, address, theirs), daemon=True).start()
        theirs.close()
        address = _heard(ours, 0.0)
    return pipes[0][0], pipes[1][0]


def _heard(end: Connection, expected_s: float) -> Any:
    if not end.poll(expected_s + _PATIENCE_S):
        raise TimeoutError("one end did not report")
    try:
        return end.recv()
    except EOFError as error:
        raise TimeoutError("one end has ended") from error


def _serve(kind: Kind, place: int, address: Any, orders: Connection) -> None:
    """One end's process: a turn for each order, until the orders end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # for the caller, who ends us
    raise_priority()  # before there are sockets, whose threads inherit it
    with _sockets(kind, place, address) as sockets:
        robot = isinstance(sockets, RobotSockets)
        orders.send((sockets.control_endpoint, sockets.view_endpoint) if robot else getattr(sockets, "address", None))
        end = _end(kind, place, sockets)
        while True:
            try:
                order = orders.recv()
            except EOFError:
                return
            orders.send(_turn(end, *order))


def _sockets(kind: Kind, place: int, address: Any) -> AbstractContextManager[Any]:
    if kind == "bare UDP":
        return DatagramLink(address)
    if kind == "bare ZeroMQ":
        return BareZeroMQLink(address)
    return OperatorSockets(*address) if place else RobotSockets("tcp://127.0.0.1:0", "tcp://127.0.0.1:0")


def _end(kind: Kind, place: int, sockets: Any) -> End:
    if kind == "whole ends":
        return OperatorEnd(sockets) if place else RobotEnd(sockets)
    link = RobotLink(sockets) if isinstance(sockets, RobotSockets) else sockets
    return BareEnd(link, BYTES["operator" if place else "robot"])


def _turn(end: End, first_s: float, start_s: float, end_s: float, period_s: float) -> tuple[float, float]:
    """The share of a core from `start_s` to `end_s`, and messages sent in each second."""
    began: tuple[float, float, int] | None = None
    now_s = first_s
    for now_s in end.run(first_s, end_s, period_s):
        if began is None and now_s >= start_s:
            began = now_s, cpu_s(), end.sent
    began_s, before_s, sent = began or (first_s, 0.0, 0)
    passed_s = now_s - began_s
    return (cpu_s() - before_s) / passed_s, (end.sent - sent) / passed_s
