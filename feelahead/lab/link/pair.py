"""Two processes on this machine that send to each other in turns."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from multiprocessing.connection import Connection
from typing import Any, Literal

from common.clock import MonotonicClock
from common.realtime.priority import raise_priority, schedule_realtime
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from feelahead.lab.link.bare import BareZeroMQLink, DatagramLink, RobotLink
from feelahead.lab.link.ends import BYTES, PATIENCE_S, SETTLING_S, BareEnd, EmulatedEnd, OperatorEnd, RobotEnd, Turn

Kind = Literal["emulated link", "whole ends", "their sockets", "bare ZeroMQ", "bare UDP"]
Take = Callable[[Turn], tuple[dict[str, Any], dict[str, Any]]]
"""Have both ends take a turn; the results of the robot's end and of the operator's."""


@contextmanager
def pair(kind: Kind, *, realtime: bool = False) -> Iterator[Take]:
    """Start both processes; yield what has them take a turn: the results of the robot's end and of the operator's.

    TimeoutError when an end does not report, PermissionError when SCHED_FIFO is asked for and refused.
    """
    context = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        pipes: list[Connection] = []
        address: Any = None
        for place in range(2):
            ours, theirs = context.Pipe()
            stack.callback(ours.close)  # which ends the process
            context.Process(target=_serve, args=(kind, place, address, realtime, theirs), daemon=True).start()
            theirs.close()
            pipes.append(ours)
            address = _heard(ours, 0.0)

        def take(turn: Turn) -> tuple[dict[str, Any], dict[str, Any]]:
            start_s = MonotonicClock().now() + (SETTLING_S if turn.count else 0.0)
            for place, pipe in enumerate(pipes):
                # Half a period apart, so that no kind finds deadlines and messages at the same instant by chance.
                pipe.send((start_s + 0.5 * place * turn.period_s, turn))
            one, other = (_heard(pipe, turn.seconds + turn.count * turn.period_s) for pipe in pipes)
            return one, other

        yield take


def _heard(pipe: Connection, expected_s: float) -> Any:
    if not pipe.poll(expected_s + 2.0 * PATIENCE_S):
        raise TimeoutError("one end of the link did not report")
    try:
        said = pipe.recv()
    except EOFError as error:
        raise TimeoutError("one end of the link has ended") from error
    if isinstance(said, Exception):
        raise said
    return said


def _serve(kind: Kind, place: int, address: Any, realtime: bool, orders: Connection) -> None:
    """Run one end's process: a turn for each order, until the orders end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the caller ends this process
    raise_priority()  # before there are sockets, whose threads inherit it
    try:
        if realtime:
            schedule_realtime()
    except PermissionError as error:
        orders.send(error)
        return
    with ExitStack() as stack:
        sockets: Any
        if kind == "bare UDP":
            stack.callback((sockets := DatagramLink(address)).close)
        elif kind == "bare ZeroMQ":
            stack.callback((sockets := BareZeroMQLink(address)).close)
        else:
            ours: AbstractContextManager[Any] = (
                OperatorSockets(*address) if place else RobotSockets("tcp://127.0.0.1:0", "tcp://127.0.0.1:0")
            )
            sockets = stack.enter_context(ours)
        robot = isinstance(sockets, RobotSockets)
        orders.send((sockets.control_endpoint, sockets.view_endpoint) if robot else getattr(sockets, "address", None))
        end = _end(kind, place, sockets)
        while True:
            try:
                start_s, turn = orders.recv()
            except EOFError:
                return
            orders.send(end.turn(start_s, turn))


def _end(kind: Kind, place: int, sockets: Any) -> RobotEnd | OperatorEnd | BareEnd | EmulatedEnd:
    if kind == "whole ends":
        return OperatorEnd(sockets) if place else RobotEnd(sockets)
    link = RobotLink(sockets) if isinstance(sockets, RobotSockets) else sockets
    if kind == "emulated link":
        return EmulatedEnd(link, "to_robot" if place else "to_operator")
    return BareEnd(link, BYTES[place])
