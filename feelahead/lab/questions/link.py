"""How close is the emulated link to the kernel's netem, and how much processor time do both ends take?

feelahead bench link
feelahead bench link --virtual --against tests/data/netem/normal.csv.gz --seeds 20
"""

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import tyro
from msgspec import Meta
from rich.console import RenderableType
from rich.text import Text

from common.emulation.clauses import LinkModel
from common.emulation.figures import report_lines
from common.emulation.profile import LinkProfile
from common.emulation.spec import LinkSpec
from feelahead.lab.goals import Goal
from feelahead.lab.link.pair import Kind, pair
from feelahead.lab.link.samples import band_of, compare_one, judge, needs_band, pair_of_runs, play, read_link_sample
from feelahead.lab.sweep import Question, Sweep, cell_of
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown

_BARE_LIMIT: Final = 1.3
_KINDS: Final[tuple[Kind, ...]] = ("whole ends", "bare ZeroMQ")
_ROUNDS: Final = 7
_PAIRS: Final = 10
"""Number of pairs of runs of the model that are compared with each other, for each seed."""
_COMPARED: Final = (
    *("seed", "distance", "mean_error_ms", "sd_error_ms"),
    *("late_share", "loss_share", "mean_burst", "stalls"),
)


@dataclass(frozen=True)
class Played:
    """Cell that runs the model of one link in virtual time."""

    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = "delay 50ms 10ms distribution normal"
    """With --virtual: the link, in netem's syntax. If it has two directions, the one to the operator is used."""
    link_model: LinkModel = "datagram"
    """datagram: messages may be lost and reordered. stream: messages stay in order and losses delay them."""
    rate: Annotated[float, Meta(ge=1.0, le=1e5), tyro.conf.arg(metavar="HZ")] = 1000.0
    """Number of messages a second."""
    count: Annotated[int, Meta(ge=2, le=1_000_000), tyro.conf.arg(metavar="N")] = 6000
    """Number of messages."""
    bytes: Annotated[int, Meta(ge=1, le=60_000), tyro.conf.arg(metavar="N")] = 142
    """Size of a message, which the link's `rate` counts; 142 are 100 bytes and their UDP, IPv4 and Ethernet headers."""
    against: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """With --virtual: a recording of netem to compare with, with the columns seq, sent_ns, delay_ns. Its times of
    sending are used instead of --rate and --count."""

    def profile(self, seed: int) -> LinkProfile:
        """Return the profile of the link, with this seed."""
        return LinkSpec.parse(self.link, seed, self.link_model).profile("to_operator")


@dataclass(frozen=True)
class LinkSweep(Played, Sweep):
    """Measure the processor time of the link's two ends at 1 kHz, alternating with bare ZeroMQ sockets.

    Each end does all the work between the control law and the controller. With --virtual: compare the model of a link
    with its specification, and with a recording of the kernel's netem.
    """

    virtual: bool = False
    """Run the emulated link alone, in virtual time."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.profile(0)
        if self.against is not None and not self.virtual:
            raise ValueError(f"--against {self.against}: is given without --virtual; valid: both, or neither")


@dataclass(frozen=True)
class Interleaved:
    """Cell that measures our ends and bare ZeroMQ's, interleaved."""

    rate: float
    rounds: int


def cells(settings: LinkSweep) -> Iterator[Interleaved | Played]:
    """Yield the one cell that the flags choose."""
    yield (
        cell_of(Played, settings) if settings.virtual else Interleaved(settings.rate, 2 if settings.quick else _ROUNDS)
    )


def run(cell: Interleaved | Played, seed: int) -> Iterator[Row]:
    """Run one cell."""
    if isinstance(cell, Played):
        yield _play(cell, seed)
    else:
        with ExitStack() as stack:
            measures = {kind: stack.enter_context(pair(kind)) for kind in _KINDS}
            for number in range(cell.rounds):
                for kind, measure in measures.items():
                    robot, operator = measure(1.0, 1.0 / cell.rate)
                    shares: Row = {"robot": robot["share"], "operator": operator["share"]}
                    sent = 0.5 * (robot["sent_per_s"] + operator["sent_per_s"])
                    yield {"round": number, "kind": kind} | shares | {"sent_per_s": sent}


def _play(cell: Played, seed: int) -> Row:
    profile = cell.profile(seed)
    recorded = None if cell.against is None else read_link_sample(cell.against, "--against")
    sent_s = [number / cell.rate for number in range(cell.count)] if recorded is None else recorded.sent_s.tolist()
    before_s = time.process_time()
    sample, line = play(profile, sent_s, cell.bytes)
    row: Row = {"us_a_message": 1e6 * (time.process_time() - before_s) / len(sent_s), "line": line.summary()}
    arrived_ms = 1e3 * sample.arrived_s
    row["arrived"] = arrived_ms.size
    if arrived_ms.size:
        p1, p50, p95, p99 = np.quantile(arrived_ms, (0.01, 0.5, 0.95, 0.99))
        row |= {"mean_ms": arrived_ms.mean(), "sd_ms": arrived_ms.std()}
        row |= {"p1_ms": p1, "p50_ms": p50, "p95_ms": p95, "p99_ms": p99}
    if recorded is not None:
        reference, stalls = recorded.without_stalls(profile)
        row |= {"stalls": stalls} | compare_one(profile, reference, seed, cell.bytes)
        if needs_band(profile):
            pairs = range(_PAIRS * seed, _PAIRS * (seed + 1))
            row["band"] = [pair_of_runs(profile, reference, one, cell.bytes) for one in pairs]
    return row


def show(settings: LinkSweep, table: Table) -> Iterator[RenderableType]:
    """Yield the link's settings and figures in words, and the tables."""
    if settings.virtual:
        yield from map(Text, report_lines({"in virtual time": table.rows[0]["line"]}))
        us = float(np.median(table.values("us_a_message")))
        share = 2e-4 * settings.rate * us
        yield Text(f"processor time of the line alone: {us:.1f} us a message, {share:.2f} % of a core both ways")
        if settings.against is not None:
            yield shown("the model beside the recording", _COMPARED, table.lines(*_COMPARED))
    else:
        names = ("robot", "operator", "sent_per_s")
        groups = ((kind, rows) for (kind,), rows in table.groups("kind"))
        shares = ((kind, *(float(np.median(rows.values(name))) for name in names)) for kind, rows in groups)
        yield shown(
            "shares of a core without spinning and without a link, interleaved (medians)", ("ends", *names), shares
        )


def ratio(rounds: Table) -> float:
    """Return how many times more processor time our ends take than bare ZeroMQ's: the median over all rounds.

    Both are compared within a round, as the machine's speed varies.
    """
    ours, bare = ([row["robot"] + row["operator"] for row in rounds.where(kind=kind)] for kind in _KINDS)
    return float(np.median(np.divide(ours, bare)))


def goals(settings: LinkSweep, table: Table) -> Iterator[Goal]:
    """Yield the goals: the figures with their limits."""
    if settings.against is not None:
        profile = settings.profile(0)
        reference, _ = read_link_sample(settings.against, "--against").without_stalls(profile)
        pairs = [one for row in table for one in row.get("band", ())]
        yield from judge(profile, reference, table.rows, band_of(pairs) if pairs else None)
    elif not settings.virtual:
        yield Goal("whole ends by bare ZeroMQ, share of a core", ratio(table), _BARE_LIMIT)


QUESTION = Question("bench link", LinkSweep, cells, run, show, goals=goals, timed=True)
