"""The emulated link in real time: two processes on loopback, each of which sends, delays and receives.

Messages are paced as the sides pace theirs: sleep in the sockets until shortly before the next one is due to be sent
or released, or something arrives.
"""

import contextlib
import math
import multiprocessing
import resource
import signal
import struct
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

import numpy as np

from common.clock import MonotonicClock
from common.emulation.delay_line import DelayLine
from common.emulation.spec import Direction, LinkSpec
from common.realtime.pacing import SPIN_S, Pacer, wait_for_turn
from common.realtime.priority import raise_priority, schedule_realtime
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from feelahead.benchmarks.link.peers import Link, RobotLink
from feelahead.benchmarks.link.samples import LinkSample

HEADER = struct.Struct("<qd")
"""Number and time of sending; the number −1 says hello, −2 that nothing more will come."""
_HELLO, _END = -1, -2
_START_DELAY_S = 0.3
_PATIENCE_S = 60.0
_GLANCE_S = 0.2


@dataclass(frozen=True)
class Plan:
    """What both ends do."""

    link: LinkSpec
    count: int
    """Messages in each direction."""
    period_s: float
    size_bytes: int
    """Of a message as the link counts it."""
    spin_s: float = SPIN_S
    """How long both ends keep the processor busy before what is due."""
    realtime: bool = False
    """Whether both ends ask for SCHED_FIFO."""


@dataclass(frozen=True)
class EndResult:
    """What one end did and saw."""

    sent_s: np.ndarray
    """(n,) when each message entered the delay line here."""
    received_s: np.ndarray
    """(n,) when each of the other end's messages came out here; NaN: never."""
    line: dict[str, Any]
    """The delay line's summary."""
    unsent: int
    """Messages that the socket refused, because too many left at once."""
    cpu_share: float
    """Of one core, from the first message to the last."""


@dataclass(frozen=True)
class RealRun:
    """Both ends of a run."""

    robot: EndResult
    operator: EndResult

    @property
    def cpu_share(self) -> float:
        """Of one core, both ends together."""
        return self.robot.cpu_share + self.operator.cpu_share

    def sample(self, direction: Direction) -> LinkSample:
        """The messages of one direction."""
        sender, receiver = (self.robot, self.operator) if direction == "to_operator" else (self.operator, self.robot)
        return LinkSample(sender.sent_s, receiver.received_s - sender.sent_s)


def run_real(plan: Plan, waiting: Callable[[float], object]) -> RealRun:
    """Run both ends, each in a process of its own; `waiting` hears every so many seconds that have passed.

    TimeoutError when an end does not appear or report, PermissionError when SCHED_FIFO is asked for and refused.
    """
    context = multiprocessing.get_context("spawn")
    pipes = [context.Pipe() for _ in range(2)]
    robot = context.Process(target=_robot_process, args=(plan, pipes[0][1]), daemon=True)
    children = [robot]
    robot.start()
    try:
        address = _next(pipes[0][0], robot, waiting, _PATIENCE_S)
        operator = context.Process(target=_operator_process, args=(plan, address, pipes[1][1]), daemon=True)
        children.append(operator)
        operator.start()
        patience_s = plan.count * plan.period_s + 6.0 * _PATIENCE_S
        results = [_next(pipes[side][0], child, waiting, patience_s) for side, child in enumerate(children)]
    finally:
        # Which tells the children that they may go.
        for pipe in pipes:
            for end in pipe:
                end.close()
        for child in children:
            child.join(timeout=1.0)
            if child.is_alive():
                child.kill()
    return RealRun(*results)


def _next(pipe: Connection, child: BaseProcess, waiting: Callable[[float], object], patience_s: float) -> Any:
    """What the child says next; the error that it says, too, is raised here."""
    clock = MonotonicClock()
    start_s = clock.now()
    while not pipe.poll(_GLANCE_S):
        waiting(_GLANCE_S)
        if not child.is_alive() or clock.now() - start_s > patience_s:
            raise TimeoutError("one end of the link did not report")
    said = pipe.recv()
    if isinstance(said, Exception):
        raise said
    return said


def _robot_process(plan: Plan, results: Connection) -> None:
    def run() -> None:
        with RobotSockets("tcp://127.0.0.1:0", "tcp://127.0.0.1:0") as sockets:
            results.send((sockets.control_endpoint, sockets.view_endpoint))
            _run_and_stay(plan, "to_operator", RobotLink(sockets), results)

    _guarded(plan, run, results)


def _operator_process(plan: Plan, address: Any, results: Connection) -> None:
    def run() -> None:
        with OperatorSockets(*address) as sockets:
            _run_and_stay(plan, "to_robot", sockets, results)

    _guarded(plan, run, results)


def _guarded(plan: Plan, run: Callable[[], None], results: Connection) -> None:
    """`run`, with what stands in the way told to the caller: no permission, nobody at the other end."""
    # Ctrl-C is for the caller, who ends us.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        # Before there are sockets, so that their threads inherit it.
        raise_priority()
        if plan.realtime:
            schedule_realtime()
        run()
    except OSError as error:
        with contextlib.suppress(OSError):
            results.send(error)


def _run_and_stay(plan: Plan, direction: Direction, link: Link, results: Connection) -> None:
    results.send(run_end(plan, direction, link))
    # The other end may still wait for our last words: the sockets stay open until the caller has both reports.
    results.poll(_PATIENCE_S)


def run_end(plan: Plan, direction: Direction, link: Link) -> EndResult:
    """Send `direction`'s messages through a delay line, and note what comes the other way, until both are through.

    TimeoutError when the other end does not appear.
    """
    clock = MonotonicClock()
    start_s = _meet(direction, link, clock)
    line: DelayLine[bytes] = DelayLine(plan.link.profile(direction))
    sent_s = [math.nan] * plan.count
    received_s = [math.nan] * plan.count
    padding = bytes(max(0, plan.size_bytes - HEADER.size))
    before_s = cpu_s()
    pacer = Pacer(plan.period_s, start_s)
    number = 0
    last_s = start_s + plan.count * plan.period_s + _PATIENCE_S
    unsent = 0
    arrived = True
    peer_ended = ended = False
    while not (peer_ended and ended):
        now_s = clock.now()
        if now_s > last_s:
            break
        # A drain costs more than all else, and is in vain when a deadline woke us.
        received = link.receive() if arrived else ()
        received_now_s = clock.now()
        for payload in received:
            place, _ = HEADER.unpack_from(payload)
            if place == _END:
                peer_ended = True
            elif 0 <= place < plan.count and math.isnan(received_s[place]):
                received_s[place] = received_now_s
        # A burst makes up for turns that were missed: every message is to be sent.
        while number < plan.count and now_s >= start_s + number * plan.period_s:
            sent_s[number] = now_s
            line.push(now_s, HEADER.pack(number, now_s) + padding, plan.size_bytes)
            number += 1
        if pacer.due(now_s):
            pacer.begin(now_s)
        now_s = clock.now()
        for message in line.pop(now_s):
            unsent += not link.send(message)
        due_s = line.next_due()
        if due_s is None and number == plan.count and not ended:
            ended = True
            busy_s = clock.now() - start_s
            cpu_share = (cpu_s() - before_s) / busy_s
            # A socket that is full of our messages refuses at first.
            for _ in range(100):
                if link.send(HEADER.pack(_END, now_s)):
                    break
                link.wait(0.01)
            last_s = now_s + _PATIENCE_S
        arrived = wait_for_turn(pacer, clock, link.wait, due_s, plan.spin_s)
    return EndResult(np.array(sent_s), np.array(received_s), line.summary(), unsent, cpu_share if ended else math.nan)


def _meet(direction: Direction, link: Link, clock: MonotonicClock) -> float:
    """Say hello until both ends are there; when to begin, on the clock that both read."""
    give_up_s = clock.now() + 3.0 * _PATIENCE_S
    while clock.now() < give_up_s:
        if direction == "to_robot":
            link.send(HEADER.pack(_HELLO, 0.0))
        link.wait(0.05)
        for payload in link.receive():
            place, start_s = HEADER.unpack_from(payload)
            if place == _HELLO:
                if direction == "to_robot":
                    return float(start_s)
                start_s = clock.now() + _START_DELAY_S
                link.send(HEADER.pack(_HELLO, start_s))
                return float(start_s)
    raise TimeoutError("the other end of the link did not appear")


def cpu_s() -> float:
    """Processor time of this process with all its threads, in seconds."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime
