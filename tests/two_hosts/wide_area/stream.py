"""Does our emulation of `stream` delay messages as the kernel's TCP does, on a connection of equal delay and loss?

python -m tests.two_hosts.wide_area stream --delay 25 100 --loss 1 --seconds 60
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Final

import tyro
from msgspec import Meta
from rich.console import RenderableType

from common.emulation.spec import LinkSpec
from common.limits import Limited
from feelahead.lab.link.samples import play
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from tests.two_hosts.wide_area.messages import PAYLOAD_BYTES, ages
from tests.two_hosts.wide_area.tunnels import WideArea
from tests.two_hosts.wide_area.wire_direction import DirectionSettings

_MODEL: Final = "stream"
_LAST_S: Final = 3.0
"""Seconds, beside the delay, in which the last messages may still arrive, as TCP may send them again"""
_Numbers = Annotated[tuple[float, ...], tyro.conf.arg(metavar="NUMBER...")]


@dataclass(frozen=True)
class StreamSweep(Sweep):
    """Send messages of 156 bytes in one direction: over ZeroMQ and the kernel's TCP, and through the emulation.

    Needs root, iproute2 and /dev/net/tun.
    """

    delay: _Numbers = (25.0, 100.0)
    """Delay in milliseconds, in each direction."""
    loss: _Numbers = (1.0,)
    """Per cent of packets lost, in each direction."""
    hz: _Numbers = (100.0, 250.0)
    """Number of messages a second."""
    control: tuple[str, ...] = ("reno", "cubic", "bbr")
    """TCP's congestion control: reno, cubic, bbr, or another that the machine has."""
    seconds: Annotated[float, Meta(ge=1.0, le=3600.0)] = 30.0
    """Length of each run in seconds, after 3 s in which TCP opens its window."""

    def __post_init__(self) -> None:
        super().__post_init__()
        list(cells(self))


@dataclass(frozen=True)
class Cell(Limited):
    delay: Annotated[float, Meta(ge=0.0, le=5000.0)]
    loss: Annotated[float, Meta(ge=0.0, le=100.0)]
    hz: Annotated[float, Meta(ge=1.0, le=1e4)]
    control: str
    """Congestion control of the kernel's TCP, or `stream` for the emulation"""
    seconds: float


def cells(settings: StreamSweep) -> Iterator[Cell]:
    """Yield all combinations of the values; for each link the emulation comes first."""
    for delay in settings.delay:
        for loss in settings.loss:
            for hz in settings.hz:
                for control in (_MODEL, *settings.control):
                    yield Cell(delay, loss, hz, control, settings.seconds)


def run(cell: Cell, seed: int) -> Iterator[Row]:
    """Send the messages of one cell; yield the figures of their ages."""
    if cell.control == _MODEL:
        link = LinkSpec.parse(f"delay {cell.delay}ms loss {cell.loss}%", seed, "stream")
        sent_s = [number / cell.hz for number in range(int(cell.hz * cell.seconds))]
        yield ages(play(link.profile("to_operator"), sent_s, PAYLOAD_BYTES)[0].arrived_s)
        return
    words = DirectionSettings(cell.delay / 1e3, cell.loss / 1e2)
    with WideArea({"to_operator": words, "to_robot": words}, cell.control, seed) as wide:
        with wide.run("operator", "messages", "receive") as receiver:
            receiver.hear()
            with wide.run("robot", "messages", "send", str(cell.hz), str(cell.seconds)) as sender:
                sender.hear()
                time.sleep(_LAST_S + cell.delay / 1e3)
                found = receiver.last()
        yield found | {name: value for name, value in wide.figures().items() if name.startswith("late")}


def show(_: StreamSweep, table: Table) -> Iterator[RenderableType]:
    """Show a table with a line for each link and rate: mean / p50 / p95 / p99 of the ages."""
    kinds = list(dict.fromkeys(row["control"] for row in table))
    names = ("mean_ms", "p50_ms", "p95_ms", "p99_ms")
    lines = []
    for (delay, loss, hz), rows in table.groups("delay", "loss", "hz"):
        line = [f"{delay:g} ms, {loss:g} %, {hz:g} Hz"]
        for kind in kinds:
            line += [" / ".join(f"{row[name]:.0f}" for name in names) for row in rows.where(control=kind)][:1]
        lines.append(line)
    yield shown("ages in ms, mean / p50 / p95 / p99", ("each way", *kinds), lines)


QUESTION: Final = Question("wide-area stream", StreamSweep, cells, run, show, timed=True)
