"""How near is the emulated link to its words and to the kernel's netem, and what do both ends cost beside bare sockets?

feelahead bench link --link "delay 50ms 10ms distribution normal loss 1%" --count 3000
feelahead bench link --virtual --against tests/data/netem/normal.csv.gz --seeds 20
feelahead bench link --estimates --seeds 100
"""

import contextlib
import csv
import dataclasses
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import tyro
from msgspec import Meta
from rich.box import MARKDOWN
from rich.console import RenderableType
from rich.table import Table as Shown
from rich.text import Text

from common.emulation.clauses import LinkModel
from common.emulation.figures import report_lines
from common.emulation.spec import LinkSpec
from common.errors import ConfigurationError, FeelaheadError
from common.files.output_file import output_file, require_output_file
from common.realtime.pacing import SPIN_S
from feelahead.lab.goals import Goal
from feelahead.lab.link import clocks
from feelahead.lab.link.ends import HEADER, Turn
from feelahead.lab.link.pair import Kind, pair
from feelahead.lab.link.samples import (
    SeedResult,
    band_of,
    compare_one,
    judge,
    needs_band,
    pair_of_runs,
    play,
    read_link_sample,
)
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table

_RELEASE_LIMIT_US: Final = 200.0
_CPU_LIMIT: Final = 0.20
_BARE_LIMIT: Final = 1.3
_RESTING: Final = 3000
"""Messages of the runs that rest instead of spinning: they tell where the processor time goes."""
_TURNED: Final[tuple[Kind, ...]] = ("whole ends", "their sockets", "bare ZeroMQ", "bare UDP")
_PAIRS: Final = 10
"""Pairs of the model's own runs, for each seed."""


@dataclass(frozen=True)
class LinkSweep(Sweep):
    """Two processes over loopback with the emulated link between them; then both ends beside bare sockets.

    With --virtual, nothing waits: the model alone, beside the words, and beside a recording of the kernel's netem.
    With --estimates, how well each side knows the other's clock and the delays, beside the truth, in virtual time.
    """

    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = "delay 50ms 10ms distribution normal"
    """The emulated link, in netem's words; where directions differ, the one to the operator is compared and written."""
    link_model: LinkModel = "datagram"
    """datagram loses and reorders, stream keeps the order and turns loss into delay."""
    rate: Annotated[float, Meta(ge=1.0, le=1e5), tyro.conf.arg(metavar="HZ")] = 1000.0
    """Messages a second in each direction."""
    count: Annotated[int, Meta(ge=2, le=1_000_000), tyro.conf.arg(metavar="N")] = 6000
    """Messages in each direction."""
    bytes: Annotated[int, Meta(ge=HEADER.size, le=60_000), tyro.conf.arg(metavar="N")] = 142
    """Size of a message, which `rate` in the link counts: 100 bytes with their UDP, IPv4 and Ethernet headers."""
    spin: Annotated[float, Meta(ge=0.0, le=1e5), tyro.conf.arg(metavar="US")] = 1e6 * SPIN_S
    """Time that the processor is kept busy before a message is due: 0 costs least, more is more exact."""
    realtime: bool = False
    """Run both ends under SCHED_FIFO, where that is permitted."""
    virtual: bool = False
    """In virtual time, without sockets."""
    against: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """With --virtual: a recording to compare with (seq, sent_ns, delay_ns), whose send times replace --rate and
    --count."""
    messages: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """Write every message of the first run there: seq, sent_ns, received_ns; a lost one has no received_ns."""
    estimates: bool = False
    """Estimates of clock offsets and one-way delays instead."""
    seconds: Annotated[float, Meta(ge=1.0, le=3600.0), tyro.conf.arg(metavar="SECONDS")] = 5.0
    """Traffic of each run of --estimates."""

    def __post_init__(self) -> None:
        super().__post_init__()
        LinkSpec.parse(self.link, 0, self.link_model)
        if self.against is not None and not self.virtual:
            raise ValueError(f"--against {self.against}: valid: with --virtual")
        if self.virtual and (self.realtime or self.estimates):
            raise ValueError("--virtual with --realtime or --estimates; valid: one of them")
        require_output_file("--messages", self.messages)


@dataclass(frozen=True)
class Cell:
    """One link, played, driven in real time, or without delay and in turns."""

    part: str
    link: str = ""
    link_model: LinkModel = "datagram"
    rate: float = 1000.0
    count: int = 6000
    bytes: int = 142
    spin: float = 0.0
    realtime: bool = False
    against: str | None = None

    def spec(self, seed: int) -> LinkSpec:
        """Parse the link."""
        return LinkSpec.parse(self.link, seed, self.link_model)


def cells(settings: LinkSweep) -> Iterator[Cell | clocks.ClockCell]:
    """Lay out what the flags choose."""
    if settings.estimates:
        skews = (20.0,) if settings.quick else (20.0, 100.0)
        for name in clocks.SCENARIOS:
            for skew in skews:
                yield clocks.ClockCell("estimates", name, skew, settings.seconds)
        return
    if settings.virtual:
        played = dataclasses.replace(_real(settings, settings.count), part="virtual", spin=0.0)
        yield dataclasses.replace(played, against=None if settings.against is None else str(settings.against))
        return
    count = min(settings.count, 1000) if settings.quick else settings.count
    yield _real(settings, count)
    resting = dataclasses.replace(_real(settings, min(count, _RESTING)), part="resting", spin=0.0)
    yield resting
    yield dataclasses.replace(resting, part="without delay", link="")
    yield Cell("turns", rate=settings.rate, count=min(7, 1 + count // 1000), realtime=settings.realtime)


def _real(settings: LinkSweep, count: int) -> Cell:
    same = ("link", "link_model", "rate", "bytes", "spin", "realtime")
    shared: dict[str, Any] = {name: getattr(settings, name) for name in same}
    return Cell("real", count=count, **shared)


def run(cell: Cell | clocks.ClockCell, seed: int) -> Iterator[Row]:
    """Run one of them."""
    if isinstance(cell, clocks.ClockCell):
        yield from clocks.run(cell, seed)
        return
    if cell.part == "virtual":
        yield _virtual(cell, seed)
        return
    try:
        yield from _turns(cell) if cell.part == "turns" else _driven(cell, seed)
    except TimeoutError as error:
        raise FeelaheadError(f"{error}; is the machine too busy?") from error
    except PermissionError as error:
        raise ConfigurationError("--realtime: SCHED_FIFO is not permitted; valid: as root") from error


def _virtual(cell: Cell, seed: int) -> Row:
    profile = cell.spec(seed).profile("to_operator")
    recorded = None if cell.against is None else read_link_sample(Path(cell.against), "--against")
    sent_s = [number / cell.rate for number in range(cell.count)] if recorded is None else recorded.sent_s.tolist()
    before_s = time.process_time()
    sample, line = play(profile, sent_s, cell.bytes)
    row = {"us_a_message": 1e6 * (time.process_time() - before_s) / len(sent_s), "line": line.summary()}
    row |= _messages(sample.sent_s, sample.sent_s + sample.delay_s)
    if recorded is not None:
        reference, stalls = recorded.without_stalls(profile)
        row |= {"stalls": stalls} | dataclasses.asdict(compare_one(profile, reference, seed, cell.bytes))
        if needs_band(profile):
            pairs = range(_PAIRS * seed, _PAIRS * (seed + 1))
            row["band"] = [pair_of_runs(profile, reference, one, cell.bytes) for one in pairs]
    return row


def _driven(cell: Cell, seed: int) -> Iterator[Row]:
    turn = Turn(0.0, 1.0 / cell.rate, cell.spec(seed), cell.count, cell.bytes, 1e-6 * cell.spin)
    with pair("emulated link", realtime=cell.realtime) as take:
        robot, operator = take(turn)
    for direction, sender, receiver in (("to_operator", robot, operator), ("to_robot", operator, robot)):
        yield {
            "direction": direction,
            "share": sender["share"],
            "unsent": sender["unsent"],
            "line": sender["line"],
            **{f"release_{name}_us": value for name, value in sender["line"]["achieved"]["release_error_us"].items()},
            **_messages(sender["sent_s"], receiver["received_s"]),
        }


def _messages(sent_s: Any, received_s: Any) -> Row:
    """Give figures of the delays, and the messages themselves as lists."""
    delays_ms = 1e3 * (received_s - sent_s)
    arrived_ms = delays_ms[~np.isnan(delays_ms)]
    row: Row = {"arrived": arrived_ms.size}
    if arrived_ms.size:
        quantiles = dict(
            zip(("p1", "p50", "p95", "p99"), np.quantile(arrived_ms, (0.01, 0.5, 0.95, 0.99)), strict=True)
        )
        figures = {"mean": arrived_ms.mean(), "sd": arrived_ms.std()} | quantiles
        row |= {f"{name}_ms": float(value) for name, value in figures.items()}
    row["sent_ns"] = [round(1e9 * one) for one in sent_s.tolist()]
    row["received_ns"] = [None if math.isnan(one) else round(1e9 * one) for one in received_s.tolist()]
    return row


def _turns(cell: Cell) -> Iterator[Row]:
    turn = Turn(1.0, 1.0 / cell.rate)
    with contextlib.ExitStack() as stack:
        takes = {kind: stack.enter_context(pair(kind, realtime=cell.realtime)) for kind in _TURNED}
        for number in range(cell.count):
            for kind, take in takes.items():
                robot, operator = take(turn)
                both = {"robot": robot["share"], "operator": operator["share"]}
                sent_per_s = 0.5 * (robot["sent_per_s"] + operator["sent_per_s"])
                yield {"turn": number, "kind": kind, **both, "sent_per_s": sent_per_s}


def show(settings: LinkSweep, table: Table) -> Iterator[RenderableType]:
    """Say what was asked and achieved; show the figures."""
    for row in table.where(part="real"):
        yield from map(Text, report_lines({row["direction"]: row["line"]}))
    played, turns = table.where(part="virtual"), table.where(part="turns")
    if len(driven := Table(row for row in table if "direction" in row)):
        names = ("mean_ms", "sd_ms", "p99_ms", "release_p50_us", "release_p99_us")
        shares = ("part", "direction", "share", "unsent")
        yield _shown("From sending to reception, and shares of a core", (*shares, *names), driven)
    if len(turns):
        yield _shown_turns(turns)
    if len(played):
        yield from map(Text, report_lines({"in virtual time": played.rows[0]["line"]}))
        us = float(np.median(played.values("us_a_message")))
        share = 2e-4 * settings.rate * us
        yield Text(f"processor time of the line alone: {us:.1f} us a message, {share:.2f} % of a core both ways")
        if settings.against is not None:
            columns = tuple(field.name for field in dataclasses.fields(SeedResult))
            yield _shown("The model beside the recording", (*columns, "stalls"), played)
    yield from clocks.tables(table.where(part="estimates"))


def _shown(title: str, columns: tuple[str, ...], rows: Table) -> Shown:
    shown = Shown(title=title, box=MARKDOWN)
    for name in columns:
        shown.add_column(name.replace("_", " "), justify="right")
    for row in rows:
        values = (row.get(name) for name in columns)
        shown.add_row(*(f"{one:.3f}" if isinstance(one, float) else "-" if one is None else str(one) for one in values))
    return shown


def _shown_turns(turns: Table) -> Shown:
    shown = Shown(title="Shares of a core without spinning and without a link, in turns (medians)", box=MARKDOWN)
    for heading in ("ends", "robot", "operator", "messages/s", "by bare ZeroMQ", "by bare UDP"):
        shown.add_column(heading, justify="left" if heading == "ends" else "right")
    for kind in _TURNED:
        medians = [float(np.median(turns.where(kind=kind).values(name))) for name in ("robot", "operator")]
        sent = float(np.median(turns.where(kind=kind).values("sent_per_s")))
        ratios = (f"{ratio(turns, kind, peer):.2f}" for peer in ("bare ZeroMQ", "bare UDP"))
        shown.add_row(kind, *(f"{value:.3f}" for value in medians), f"{sent:.0f}", *ratios)
    return shown


def ratio(turns: Table, kind: Kind, peer: Kind) -> float:
    """Return the median over the turns, each beside the peer's of the same turn: the machine's speed varies."""
    one, other = ([row["robot"] + row["operator"] for row in turns.where(kind=name)] for name in (kind, peer))
    return float(np.median(np.divide(one, other)))


def goals(settings: LinkSweep, table: Table) -> Iterator[Goal]:
    """Hold the figures against their limits."""
    shares = {
        part: sum(table.where(part=part).values("share")) / settings.seeds
        for part in ("real", "resting", "without delay")
    }
    for row in table.where(part="real"):
        yield Goal(f"release error p99 of {row['direction']}, us", row["release_p99_us"], _RELEASE_LIMIT_US)
    if len(turns := table.where(part="turns")):
        yield Goal("share of one core, both ends together", shares["real"], _CPU_LIMIT)
        added = shares["resting"] - shares["without delay"]
        yield Goal("share of one core that the emulation adds, without spinning", added, _CPU_LIMIT)
        for kind in _TURNED[:2]:
            yield Goal(f"{kind} by bare ZeroMQ, share of a core", ratio(turns, kind, "bare ZeroMQ"), _BARE_LIMIT)
    if settings.against is not None:
        profile = LinkSpec.parse(settings.link, 0, settings.link_model).profile("to_operator")
        reference, _ = read_link_sample(settings.against, "--against").without_stalls(profile)
        names = [field.name for field in dataclasses.fields(SeedResult)]
        results = [SeedResult(**{name: row[name] for name in names}) for row in table]
        pairs = [one for row in table for one in row.get("band", ())]
        yield from judge(profile, reference, results, band_of(pairs) if pairs else None)
    if settings.estimates:
        yield from clocks.goals(table)


def also(settings: LinkSweep, table: Table) -> None:
    """Write the messages of the first run to the operator."""
    if settings.messages is None or "sent_ns" not in table.rows[0]:
        return
    with output_file("--messages", settings.messages) as file:
        writer = csv.writer(file)
        writer.writerow(["seq", "sent_ns", "received_ns"])
        both = zip(table.rows[0]["sent_ns"], table.rows[0]["received_ns"], strict=True)
        writer.writerows([number, sent, received] for number, (sent, received) in enumerate(both))


QUESTION = Question("bench link", LinkSweep, cells, run, show, goals=goals, also=also, timed=True)
