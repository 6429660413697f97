"""`feelahead bench link`: what the emulated link does, beside what was asked and beside the kernel's netem."""

import csv
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from rich.console import Console
from rich.progress import Progress

from common.command.command_line import parse_settings
from common.emulation.clauses import LinkModel
from common.emulation.figures import report_lines
from common.emulation.profile import LinkProfile
from common.emulation.spec import LinkSpec
from common.errors import ConfigurationError, FeelaheadError
from common.files.output_file import output_file, require_output_file
from common.realtime.pacing import SPIN_S
from feelahead.benchmarks.link.real import HEADER, Plan, RealRun, cpu_s, run_real
from feelahead.benchmarks.link.reference import compare, independent_delays, judge, measure_band, table
from feelahead.benchmarks.link.samples import LinkSample, play, read_link_sample
from feelahead.benchmarks.link.turns import KINDS, OURS, Kind, Share, ratio, take_turns
from feelahead.benchmarks.report import Goal, Table, show, show_goals

PROGRAM = "feelahead bench link"
_WIDE = 120
_RELEASE_LIMIT_US = 200.0
_CPU_LIMIT = 0.20
_BASELINE = 3000
"""Messages without a link, to tell the emulation's cost from that of sockets and pacing."""
_SEEDS, _PAIRS = 20, 200
_TURNS, _TURN_S = 7, 1.0
_REAL_MOMENT_LIMIT_MS = 0.5


@dataclass(frozen=True)
class LinkBenchSettings:
    """What the emulated link does to messages, beside what was asked, and beside a recording of a real link.

    In real time: two processes on this machine send to each other over ZeroMQ, each delaying what it sends. Shown are
    how late messages were released, the delays from sending to reception, and the processor time; then, in turns and
    without a link, that of both whole ends, with protocol and session, of their sockets alone, and of bare ZeroMQ and
    bare UDP sockets. With --virtual, nothing waits: the model alone, message by message, the same on every machine but
    for the time taken.

    Try: feelahead bench link --link "delay 50ms 10ms distribution normal loss 1%" --count 3000
         feelahead bench link --link "delay 50ms 10ms distribution normal" --virtual
             --against tests/data/netem/normal.csv.gz
    """

    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = "delay 50ms 10ms distribution normal"
    """The emulated link, in netem's words; the sending robot side is the one shown where directions differ."""
    link_model: LinkModel = "datagram"
    """datagram loses and reorders, stream keeps the order and turns loss into delay."""
    rate: Annotated[float, tyro.conf.arg(metavar="HZ")] = 1000.0
    """Messages a second in each direction; not used where a recording gives the send times."""
    count: Annotated[int, tyro.conf.arg(metavar="N")] = 6000
    """Messages in each direction; not used where a recording gives the send times."""
    bytes: Annotated[int, tyro.conf.arg(metavar="N")] = 142
    """Size of a message, which `rate` in the link counts: 100 bytes with their UDP, IPv4 and Ethernet headers."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write every message there: seq, sent_ns, received_ns; a lost one has no received_ns."""
    spin: Annotated[float | None, tyro.conf.arg(metavar="US")] = None
    """How long the processor is kept busy before a message is due: 0 costs least, more is more exact; 200 unless
    given."""
    realtime: bool = False
    """Run both ends under SCHED_FIFO, where that is permitted: the figures of a machine without other work."""
    virtual: bool = False
    """In virtual time, without sockets."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Of the run that is shown and written."""
    seeds: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """With --virtual --against: how many runs, with the seeds 0 to N-1; 20 unless given."""
    pairs: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """With --virtual --against, where delays or losses depend on the past: pairs of runs for the model's own band; 200
    unless given."""
    sends: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """With --virtual: send times from the sent_ns of a recording, instead of --rate and --count."""
    against: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """A recording to compare with: seq, sent_ns, delay_ns, in any order; with --virtual its send times are used."""

    def __post_init__(self) -> None:
        LinkSpec.parse(self.link, 0, self.link_model)
        if not 1.0 <= self.rate <= 1e5:
            raise ValueError(f"--rate {self.rate}: valid: 1 to 100000 messages a second")
        for name, least, most in (
            ("count", 2, 1_000_000),
            ("bytes", HEADER.size, 60_000),
            ("seeds", 1, 10_000),
            ("pairs", 2, 10_000),
        ):
            if getattr(self, name) is not None and not least <= getattr(self, name) <= most:
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {least} to {most}")
        if self.spin is not None and not 0.0 <= self.spin <= 1e5:
            raise ValueError(f"--spin {self.spin}: valid: 0 to 100000 microseconds")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or more")
        self._refuse_what_would_be_passed_over()
        require_output_file("--csv", self.csv)

    def _refuse_what_would_be_passed_over(self) -> None:
        for name in ("spin", "realtime"):
            if self.virtual and getattr(self, name) not in (None, False):
                raise ValueError(f"--{name} with --virtual, where nothing waits; valid: one of them")
        for name in ("seeds", "pairs"):
            if getattr(self, name) is not None and not (self.virtual and self.against is not None):
                raise ValueError(f"--{name} {getattr(self, name)}: valid with --virtual --against alone")
        if self.sends is not None and not self.virtual:
            raise ValueError(f"--sends {self.sends}: valid with --virtual alone")

    @property
    def spec(self) -> LinkSpec:
        """The link with this run's seed."""
        return LinkSpec.parse(self.link, self.seed, self.link_model)


def bench_link(arguments: Sequence[str]) -> int:
    """Run the benchmark; exit code 0 whether or not the goals are met."""
    settings = parse_settings(LinkBenchSettings, PROGRAM, arguments)
    console = Console() if Console().is_terminal else Console(width=_WIDE)
    reference = None if settings.against is None else read_link_sample(settings.against, "--against")
    profile = settings.spec.profile("to_operator")
    with Progress(console=console, transient=True) as progress:
        if settings.virtual:
            sample = _virtual(settings, profile, reference, console, progress)
        else:
            sample = _real(settings, profile, reference, console, progress)
    if settings.csv is not None:
        write_samples(settings.csv, sample)
    return 0


def write_samples(path: Path, sample: LinkSample) -> None:
    """seq, sent_ns, received_ns of every message, in order of sending; a lost one has no received_ns."""
    with output_file("--csv", path) as file:
        writer = csv.writer(file)
        writer.writerow(["seq", "sent_ns", "received_ns"])
        for number, (sent_s, delay_s) in enumerate(zip(sample.sent_s, sample.delay_s, strict=True)):
            received = "" if math.isnan(delay_s) else round(1e9 * (sent_s + delay_s))
            writer.writerow([number, round(1e9 * sent_s), received])


def _virtual(
    settings: LinkBenchSettings,
    profile: LinkProfile,
    reference: LinkSample | None,
    console: Console,
    progress: Progress,
) -> LinkSample:
    sent_s = [number / settings.rate for number in range(settings.count)]
    if settings.sends is not None:
        sent_s = read_link_sample(settings.sends, "--sends").sent_s.tolist()
    elif reference is not None:
        sent_s = reference.sent_s.tolist()
    before_s = cpu_s()
    sample, line = play(profile, sent_s, settings.bytes)
    message_s = (cpu_s() - before_s) / len(sent_s)
    _show_lines(console, {"in virtual time": line.summary()})
    console.print(
        f"processor time of the line alone: {1e6 * message_s:.1f} us a message, "
        f"{200.0 * settings.rate * message_s:.2f} % of a core at {settings.rate:g} Hz both ways",
        highlight=False,
    )
    if reference is None:
        return sample
    kept, stalls = reference.without_stalls(profile)
    seeds, pairs = settings.seeds or _SEEDS, settings.pairs or _PAIRS
    bar = progress.add_task("seeds", total=seeds)
    results = compare(profile, kept, seeds, settings.bytes, lambda: progress.advance(bar))
    band = None
    if profile.loss is not None or not independent_delays(profile):
        bar = progress.add_task("the model's own band", total=pairs)
        band = measure_band(profile, kept, pairs, settings.bytes, lambda: progress.advance(bar))
    show(console, table(kept, stalls, results))
    show_goals(console, judge(profile, kept, results, band))
    return sample


def _real(
    settings: LinkBenchSettings,
    profile: LinkProfile,
    reference: LinkSample | None,
    console: Console,
    progress: Progress,
) -> LinkSample:
    plan = Plan(
        settings.spec,
        settings.count,
        1.0 / settings.rate,
        settings.bytes,
        spin_s=SPIN_S if settings.spin is None else 1e-6 * settings.spin,
        realtime=settings.realtime,
    )
    # What rests instead of spinning, with and without parts of it: where the processor time goes.
    resting = dataclasses.replace(plan, count=min(plan.count, _BASELINE), spin_s=0.0)
    without = dataclasses.replace(resting, link=LinkSpec())
    costs = {"without spinning": resting, "without a link either": without}
    turn_s, turns_count = min(_TURN_S, plan.count * plan.period_s), min(_TURNS, 1 + plan.count // 1000)
    bar = progress.add_task(
        "messages", total=(plan.count + len(costs) * resting.count) * plan.period_s + turns_count * len(KINDS) * turn_s
    )
    try:
        run = run_real(plan, lambda passed_s: progress.advance(bar, passed_s))
        shares = {
            name: run_real(one, lambda passed_s: progress.advance(bar, passed_s)).cpu_share
            for name, one in costs.items()
        }
        turns = take_turns(turn_s, turns_count, plan.period_s, lambda passed_s: progress.advance(bar, passed_s))
    except TimeoutError as error:
        raise FeelaheadError(f"{error}; is the machine too busy?") from error
    except PermissionError as error:
        raise ConfigurationError(
            "--realtime: SCHED_FIFO is not permitted; valid as root or with CAP_SYS_NICE"
        ) from error
    ends = {"to_operator": run.robot.line, "to_robot": run.operator.line}
    _show_lines(console, ends)
    show(console, _end_to_end(run))
    show(console, _beside_bare(turns))
    goals = [
        Goal(f"release error p99 of {name}, us", end["achieved"]["release_error_us"]["p99"], _RELEASE_LIMIT_US)
        for name, end in ends.items()
    ]
    detail = "; ".join(f"{name}: {share:.3f}" for name, share in shares.items())
    goals.append(Goal("share of one core, both ends together", run.cpu_share, _CPU_LIMIT, detail=detail))
    added = shares["without spinning"] - shares["without a link either"]
    goals.append(Goal("share of one core that the emulation adds, without spinning", added, _CPU_LIMIT))
    goals += [
        Goal(f"{kind} by bare ZeroMQ, share of a core without spinning", ratio(turns[kind], turns["bare ZeroMQ"]), 1.3)
        for kind in OURS
    ]
    sample = run.sample("to_operator")
    if reference is not None:
        kept, stalls = reference.without_stalls(profile)
        ours, our_stalls = sample.without_stalls(profile)
        detail = f"recorded {{:.2f}}, left out as stalls: {stalls} there, {our_stalls} here"
        goals += [
            Goal(
                f"difference of the {name} from the recording's, ms",
                abs(1e3 * (mine_s - theirs_s)),
                _REAL_MOMENT_LIMIT_MS,
                detail=detail.format(1e3 * theirs_s),
            )
            for name, mine_s, theirs_s in (("mean", ours.mean_s, kept.mean_s), ("sd", ours.sd_s, kept.sd_s))
        ]
    show_goals(console, goals)
    return sample


def _show_lines(console: Console, lines: dict[str, dict[str, Any]]) -> None:
    for text in report_lines(lines):
        console.print(text, highlight=False, markup=False)


def _end_to_end(run: RealRun) -> Table:
    rows = []
    for direction in ("to_operator", "to_robot"):
        sample = run.sample(direction)
        delays_ms = 1e3 * sample.arrived_s
        end = run.robot if direction == "to_operator" else run.operator
        error_us = end.line["achieved"]["release_error_us"]
        if delays_ms.size == 0:
            rows.append((direction, "0", *["-"] * 6, f"{sample.loss_share:.4f}", str(end.unsent), "-"))
            continue
        figures = [delays_ms.mean(), delays_ms.std()]
        rows.append(
            (
                direction,
                str(delays_ms.size),
                *(f"{value:.2f}" for value in figures),
                *(f"{math.floor(0.5 + error_us[name])}" for name in ("p50", "p99", "max")),
                f"{sample.late_share:.4f}",
                f"{sample.loss_share:.4f}",
                str(end.unsent),
                " / ".join(f"{value:.1f}" for value in _quantiles(delays_ms)),
            )
        )
    columns = (
        *("direction", "arrived", "mean, ms", "sd, ms", "release p50, us", "p99", "max", "reordered", "lost", "unsent"),
        "p1 / p50 / p95 / p99, ms",
    )
    return Table("From sending to reception", columns, rows, "Lost includes what the socket refused (unsent).")


def _beside_bare(turns: dict[Kind, list[Share]]) -> Table:
    rows = [
        (
            kind,
            *(f"{np.median([getattr(one, name) for one in found]):.3f}" for name in ("robot", "operator", "both")),
            f"{np.median([one.sent_per_s for one in found]):.0f}",
            *(f"{ratio(found, turns[peer]):.2f}" for peer in ("bare ZeroMQ", "bare UDP")),
        )
        for kind, found in turns.items()
    ]
    columns = ("share of a core", "robot", "operator", "both", "messages/s", "by bare ZeroMQ", "by bare UDP")
    return Table("Without spinning and without a link, in turns", columns, rows, "Medians over the turns.")


def _quantiles(values: Any) -> list[float]:
    ordered = sorted(values.tolist())
    return [ordered[min(len(ordered) - 1, int(share * len(ordered)))] for share in (0.01, 0.50, 0.95, 0.99)]
