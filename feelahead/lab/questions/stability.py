"""Where does arithmetic or the closed loop break, under the worst inputs that can be made?

feelahead bench stability --csv stability.csv --picture stability.png
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Final

import tyro
from msgspec import Meta
from rich.table import Table as Shown

from common.errors import ConfigurationError
from feelahead.lab.approaches.approach import compile_kernels
from feelahead.lab.goals import Goal
from feelahead.lab.stability import clocks, joints, looks, overlaps, rates
from feelahead.lab.stability.closed_loop import Loop, draw_map, run_loop
from feelahead.lab.stability.tally import Part
from feelahead.lab.sweep import Question, Sweep, generator
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown

CLOSED_LOOP: Final = "closed loop"
PARTS: Final[dict[str, Part]] = {
    "overlaps": overlaps.PART,
    "looks": looks.PART,
    "forward kinematics": joints.KINEMATICS,
    "resolved rate": joints.RESOLVED_RATE,
    "joint estimate": joints.ESTIMATE,
    "clock offset": clocks.OFFSET,
    "ages": clocks.AGES,
    "rate control": rates.PART,
}
_OVERCOME: Final = 1.0
"""Strongest effect as a share of the pull: one weaker than this is overcome, and the pull may touch"""


@dataclass(frozen=True)
class StabilitySweep(Sweep):
    """Try each part with adversarial inputs, against a reference or an invariant, and the closed loop before a wall.

    Every case counts: its error, NaN or infinity, exceptions, and steps where a part iterates. Then a finger pulls R2
    with 2 N towards a wall, over delays, strengths of the effects and fingers: the loop should come to rest.
    """

    parts: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME...")] = (*PARTS, CLOSED_LOOP)
    """Parts to try."""
    delay: Annotated[tuple[Annotated[float, Meta(ge=0.0, le=900.0)], ...], tyro.conf.arg(metavar="MS...")] = (
        *(0.0, 50.0, 100.0, 200.0, 400.0),
    )
    """Closed loop: delays each way in ms; with --quick the first and the last."""
    effect: Annotated[tuple[Annotated[float, Meta(ge=0.0, le=10.0)], ...], tyro.conf.arg(metavar="SHARE...")] = (
        *(0.5, 0.8, 1.0, 1.5, 3.0),
    )
    """Closed loop: strongest effect's forces, as shares of the pull; with --quick the third and the last."""
    finger: Annotated[tuple[Annotated[float, Meta(ge=1.0, le=1000.0)], ...], tyro.conf.arg(metavar="MS...")] = (
        *(10.0, 40.0, 200.0),
    )
    """Closed loop: time constants of the finger in ms; with --quick the middle one."""

    def __post_init__(self) -> None:
        super().__post_init__()
        valid = (*PARTS, CLOSED_LOOP)
        for name in self.parts:
            if name not in valid:
                raise ConfigurationError(f"--parts {name!r}: no such part; valid: {', '.join(map(repr, valid))}")
        if self.picture is not None and CLOSED_LOOP not in self.parts:
            raise ConfigurationError(f"--picture {self.picture}: parts have no figure; valid: with {CLOSED_LOOP!r}")


@dataclass(frozen=True)
class Tried:
    """Cell: one group of a part's classes."""

    part: str
    group: str
    count: int


def cells(settings: StabilitySweep) -> Iterator[Tried | Loop]:
    """Yield the groups of the parts, then the points of the closed loop."""
    for name, part in PARTS.items():
        for group in part.groups if name in settings.parts else ():
            yield Tried(name, group, part.counts[settings.quick])
    if CLOSED_LOOP in settings.parts:
        delays, effects, fingers = settings.delay, settings.effect, settings.finger
        if settings.quick:
            delays, effects = delays[:: max(1, len(delays) - 1)], effects[len(effects) // 2 :: len(effects) // 2 or 1]
            fingers = fingers[len(fingers) // 2 :][:1]
        for point in product(delays, effects, fingers):
            yield Loop(*point)


def run(cell: Tried | Loop, seed: int) -> Iterator[Row]:
    """Try one group of classes; or run the closed loop at one point."""
    if isinstance(cell, Loop):
        yield {"part": CLOSED_LOOP} | run_loop(cell, seed)
    else:
        for tally in PARTS[cell.part].check(cell.group, cell.count, generator(cell, seed)):
            yield tally.row()


def fails(row: Row) -> bool:
    """Return whether a row is a failure: a tally's, or a loop that chatters, or touches though the effect is strong."""
    if row["part"] != CLOSED_LOOP:
        return bool(row["failed"])
    return row["why"] is not None or row["state"] not in _expected(row)


def _expected(row: Row) -> tuple[str, ...]:
    return ("rests",) if row["effect_of_pull"] >= _OVERCOME else ("rests", "touches")


def show(_: StabilitySweep, table: Table) -> Iterator[Shown]:
    """Yield the table of the parts' classes, and that of the closed loop."""
    figures = ("cases", "worst error", "limit", "NaN, inf", "exceptions", "steps", "error is", "where")
    tallies = Table(row for row in table if row["part"] != CLOSED_LOOP)
    if len(tallies):
        yield shown("parts under stress", ("part: class", *figures), map(_merged, _classes(tallies)))
    loops = table.where(part=CLOSED_LOOP)
    if len(loops):
        delays = sorted(set(loops.values("delay_ms")))
        headings = ("finger, ms; effect of pull", *(f"{delay:g} ms" for delay in delays))
        rows = (
            (f"{finger:g}; {share:g}", *(", ".join(map(_ended, at.where(delay_ms=delay))) for delay in delays))
            for (finger, share), at in loops.groups("finger_ms", "effect_of_pull")
        )
        yield shown("closed loop before a wall: state after 6 s, gap or reversals, swing of the travel", headings, rows)


def _classes(tallies: Table) -> Iterator[tuple[str, Table]]:
    for (part, case, _), rows in tallies.groups("part", "case", "measure"):
        yield f"{part}: {case}", rows


def _merged(one: tuple[str, Table]) -> tuple[str | float | None, ...]:
    name, rows = one
    worst = max(rows, key=lambda row: (row["undefined"] + row["exceptions"], row["error"]))
    sums = {name: sum(rows.values(name)) for name in ("cases", "undefined", "exceptions")}
    limit = None if worst["limit"] == float("inf") else worst["limit"]
    steps = max(rows.values("steps"), default=None)
    return (
        *(name, sums["cases"], max(rows.values("error")), limit, sums["undefined"], sums["exceptions"], steps),
        *(worst["measure"], worst["where"]),
    )


def _ended(row: Row) -> str:
    if row["state"] in ("rests", "touches"):
        return f"{row['state']}" + (f", {row['gap_mm']:.0f} mm" if row["state"] == "rests" else "")
    return f"{row['state']}, {row['reversals']} x, {row['travel_swing']:.2f}"


def goals(_: StabilitySweep, table: Table) -> Iterator[Goal]:
    """Yield the goals of each part, and of the closed loop."""
    for name in PARTS:
        rows = table.where(part=name)
        if not len(rows):
            continue
        shares = {row["error"] / row["limit"] if row["limit"] else row["error"]: row["case"] for row in rows}
        yield Goal(f"{name}: worst error, of its limit", max(shares), 1.0, detail=shares[max(shares)])
        bad = sum(rows.values("undefined")) + sum(rows.values("exceptions"))
        yield Goal(f"{name}: NaN, infinity and exceptions", bad, 0.0, detail=f"of {sum(rows.values('cases'))} cases")
        steps = [row["steps"] / row["most_steps"] for row in rows if row["steps"] is not None and row["most_steps"]]
        if steps:
            yield Goal(f"{name}: most steps, of the most allowed", max(steps), 1.0)
    loops = table.where(part=CLOSED_LOOP)
    if len(loops):
        states = loops.values("state")
        yield Goal(f"{CLOSED_LOOP}: points that chatter", states.count("chatters"), 0.0, detail=f"of {len(states)}")
        wrong = sum(fails(row) for row in loops)
        detail = "must rest from an effect as strong as the pull on"
        yield Goal(f"{CLOSED_LOOP}: points in a state that they must not have", wrong, 0.0, detail=detail)


def draw(_: StabilitySweep, table: Table, path: Path) -> None:
    """Draw the map of the closed loop."""
    draw_map(table.where(part=CLOSED_LOOP), path)


QUESTION = Question(
    "bench stability", StabilitySweep, cells, run, show, draw, goals, failed=fails, prepare=compile_kernels
)
