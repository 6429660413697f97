"""What do delay, loss, rate and queue of a wide area do to both sides, over the kernel's own TCP?

python -m tests.two_hosts.wide_area --delay 100 --loss 0 0.1 1 --control reno cubic bbr --csv wide.csv
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import product
from typing import Annotated, Final, Literal

import tyro
from rich.console import RenderableType

from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import short, shown
from tests.two_hosts.wide_area.running import run_trial
from tests.two_hosts.wide_area.trial import Trial

_Numbers = Annotated[tuple[float, ...], tyro.conf.arg(metavar="NUMBER...")]


@dataclass(frozen=True)
class WideSweep(Sweep):
    """Run both sides in two network namespaces, with a wide-area network between them, for all combinations of values.

    Needs root, iproute2 and /dev/net/tun. The runs follow each other; each takes --seconds, and ten seconds to start.
    """

    delay: _Numbers = (100.0,)
    """Delay in milliseconds, in each direction."""
    loss: _Numbers = (0.0,)
    """Per cent of packets lost, in each direction."""
    burst: _Numbers = (0.0,)
    """Duration in milliseconds of bursts in which all packets are lost: a burst every 5 s, in each direction."""
    rate: _Numbers = (0.0,)
    """Rate of the robot's uplink in Mbit/s; 0: unlimited."""
    queue: _Numbers = (200.0,)
    """Longest time, in milliseconds, that a packet waits in the queue before the uplink; others are dropped."""
    control: tuple[str, ...] = ("reno",)
    """TCP's congestion control: reno, cubic, bbr, or another that the machine has."""
    connections: Annotated[tuple[int, ...], tyro.conf.arg(metavar="N...")] = (0,)
    """Number of the operator side's connections for control; 0: the operator side's default."""
    person: tuple[Literal["drives", "rests"], ...] = ("drives",)
    """drives: the scripted person drives; rests: nobody touches the controls."""
    pictures: tuple[bool, ...] = (False,)
    """Whether a page of the console receives both views and the scene."""
    observer: tuple[Literal["none", "reads", "stops"], ...] = ("none",)
    """A second operator side. none: there is none. reads: it observes. stops: SIGSTOP after a third of the time."""
    seconds: float = 20.0
    """Length of each run in seconds, from the operator side's start."""

    def __post_init__(self) -> None:
        super().__post_init__()
        list(cells(self))


_VARIED: Final = tuple(one.name for one in fields(Trial) if one.name != "seconds")


def cells(settings: WideSweep) -> Iterator[Trial]:
    for chosen in product(*(getattr(settings, name) for name in _VARIED)):
        yield Trial(**dict(zip(_VARIED, chosen, strict=True)), seconds=settings.seconds)


def run(cell: Trial, seed: int) -> Iterator[Row]:
    yield run_trial(cell, seed)


def show(_: WideSweep, table: Table) -> Iterator[RenderableType]:
    """Show a table with a line for each run: the values that vary, and the figures."""
    varied = [name for name in (*_VARIED, "seed") if len({row[name] for row in table}) > 1] or ["delay"]
    columns = {name: parts for name, parts in _COLUMNS.items() if any(table.values(part) for part in parts)}
    lines = (
        [*(_said(row[name]) for name in varied)]
        + [" / ".join(_said(row[part]) for part in parts) for parts in columns.values()]
        for row in table
    )
    yield shown("a wide area", (*varied, *columns), lines)


_COLUMNS: Final[Mapping[str, Sequence[str]]] = {
    "to operator, ms": ("to_operator_p50_ms", "to_operator_p95_ms", "to_operator_p99_ms"),
    "to robot, ms": ("to_robot_p50_ms", "to_robot_p95_ms", "to_robot_p99_ms"),
    "every arrival, p99, ms": ("slowest_to_operator_ms", "slowest_to_robot_ms"),
    "queueing p95, ms": ("queueing_p95_ms", "link_queue_p95_ms"),
    "gaps/min": ("to_operator_gaps_min", "to_robot_gaps_min"),
    "armed after, s": ("armed_after_s",),
    "armed": ("armed",),
    "stops": ("stops",),
    "why": ("why",),
    "done": ("done",),
    "kbit/s": ("to_operator_kbit_s", "to_robot_kbit_s"),
    "packets/s": ("to_operator_packets_s", "to_robot_packets_s"),
    "pictures/s": ("pictures_s",),
    "their age, ms": ("picture_p50_ms", "picture_p95_ms"),
    "late, ms": ("late_p99_ms", "late_max_ms"),
}
"""Columns of the shown table: the names of the figures that each column shows, by the column's title.

Of two directions, the first is to the operator. queueing: by the messages' ages, then in the link's own queue. late:
p99 and maximum of how late the forwarder delivered packets.
"""


def _said(value: object) -> str:
    if isinstance(value, float):
        return short(value) if abs(value) < 10.0 else f"{value:.0f}"
    if value is None or isinstance(value, bool):
        return {None: "-", True: "yes", False: "no"}[value]
    return str(value)


QUESTION: Final = Question("wide-area", WideSweep, cells, run, show, timed=True)
