"""Two processes on this machine that send to each other, and how much of a processor core each takes."""

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing.connection import Connection
from typing import Any, Final, Literal

from common.clock import MonotonicClock
from common.errors import FeelaheadError
from common.realtime.priority import raise_priority
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from feelahead.lab.link.bare import BareEnd
from feelahead.lab.link.ends import BYTES, OperatorEnd, RobotEnd

Kind = Literal["whole ends", "bare ZeroMQ"]
Measure = Callable[[float, float], list[dict[str, float]]]
"""Function that runs both ends for a round, given its length and period in seconds. It returns the figures of the
robot's end, then those of the operator's."""
_SETTLING_S: Final = 0.4
"""Time in seconds at a round's beginning, in which idle sessions resume, and which is not measured."""
_PATIENCE_S: Final = 120.0


@contextmanager
def pair(kind: Kind) -> Iterator[Measure]:
    """Start both processes, and yield the function that runs a round; FeelaheadError if an end does not answer."""
    context = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        pipes: list[Connection] = []
        address: Any = None
        for place in range(2):
            ours, theirs = context.Pipe()
            stack.callback(ours.close)  # Closing the pipe ends the process.
            context.Process(target=_serve, args=(kind, place, address, theirs), daemon=True).start()
            theirs.close()
            pipes.append(ours)
            address = _heard(ours, 0.0)

        def measure(seconds: float, period_s: float) -> list[dict[str, float]]:
            start_s = MonotonicClock().now()
            for place, pipe in enumerate(pipes):
                # Half a period apart, so that deadlines and messages never coincide by chance.
                pipe.send((start_s + 0.5 * place * period_s, seconds, period_s))
            return [_heard(pipe, seconds) for pipe in pipes]

        yield measure


def _heard(pipe: Connection, expected_s: float) -> Any:
    try:
        if pipe.poll(expected_s + _PATIENCE_S):
            return pipe.recv()
    except EOFError:
        pass
    raise FeelaheadError("one end of the link did not report; is the machine too busy?")


def _serve(kind: Kind, place: int, address: Any, orders: Connection) -> None:
    """Run the process of one end: run a round for each order that comes, until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the caller ends this process
    raise_priority()  # before there are sockets, whose threads inherit it
    with ExitStack() as stack:
        end: BareEnd | RobotEnd | OperatorEnd
        if kind == "bare ZeroMQ":
            end = BareEnd(BYTES[place], address)
            stack.callback(end.close)
            orders.send(end.address)
        elif place == 0:
            robot = stack.enter_context(RobotSockets("tcp://127.0.0.1:0", "tcp://127.0.0.1:0"))
            end = RobotEnd(robot)
            orders.send((robot.control_endpoint, robot.view_endpoint))
        else:
            end = OperatorEnd(stack.enter_context(OperatorSockets(*address)))
            orders.send(None)
        while True:
            try:
                orders.send(_measured(end, *orders.recv()))
            except EOFError:
                return


def _measured(
    end: BareEnd | RobotEnd | OperatorEnd, start_s: float, seconds: float, period_s: float
) -> dict[str, float]:
    """Run the end from `start_s`, and return its figures, measured after `_SETTLING_S`."""
    began: tuple[float, float, int] | None = None
    now_s = start_s
    for now_s in end.run(start_s, start_s + _SETTLING_S + seconds, period_s):
        if began is None and now_s >= start_s + _SETTLING_S:
            began = now_s, time.process_time(), end.sent
    began_s, before_s, sent = began or (start_s, 0.0, 0)
    passed_s = now_s - began_s
    return {"share": (time.process_time() - before_s) / passed_s, "sent_per_s": (end.sent - sent) / passed_s}
