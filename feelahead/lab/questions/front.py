"""What share f makes the paper's law best, and how good is it then?

feelahead bench front --picture front.png

§4.2 gives no value for f. A smaller f gives full strength earlier, but also for objects beside and behind. So each f is
a point between contacts and false alarms, and all of them together are a front. f is chosen on some scenes and tried on
others.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import tyro
from rich.console import RenderableType
from rich.table import Table as Shown

from feelahead.lab.approaches.approach import Approach, PullRun, compile_kernels
from feelahead.lab.approaches.evaluation import LINKS, Placement, Pulls, evaluate
from feelahead.lab.approaches.frozen import frozen_hash, frozen_scene
from feelahead.lab.approaches.laws import TriedLaw, paper_figures, with_papers
from feelahead.lab.approaches.pulls import PullKind
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from feelahead.printing.figures import shown
from feelahead.printing.pictures import colour_of, figure
from robot_side.laws.paper_settings import EnlargementTime, PaperSettings, Share

LAWS: Final = ("paper", "paper-isotropic", "swept", "none")
Group = Literal["chosen", "apart"]
GROUPS: Final[tuple[Group, ...]] = "chosen", "apart"
_AHEAD: Final[dict[Group, tuple[str, ...]]] = {
    "chosen": ("wall", "ball", "rod_5mm"),
    "apart": ("plate", "post", "wall_45", "shelf_edge"),
}
"""Scenes in which a pull ends in a contact: those on which f is chosen, and those kept apart"""
_PASSED: Final[dict[Group, tuple[str, ...]]] = {
    "chosen": ("wall_beside", "table_1_box"),
    "apart": ("cluttered", "terrain"),
}
"""Scenes in which it touches nothing"""
_PULLS: Final[tuple[tuple[PullKind, str], ...]] = (("steady", "50 ms"), ("bell", "200 ms"))
_JUDGED_S: Final = 20.0
_PROBABILITY: Final = 0.9
"""P at which pulls are judged; ten uncovered draws are then expected among a hundred"""
_SHARES: Final = (5e-2, 1e-2, 2e-3, 5e-4, 1e-4, 2e-5, 5e-6)
_DURATION_S: Final = 5.0
_PASSED_M: Final = 0.25
"""Way of the tool, in metres, after which the time in a scene that it passes is taken"""
_STYLES: Final[dict[EnlargementTime, str]] = {"always": "-", "once": "--"}
_VARIANT: Final = ("law", "enlargement")


@dataclass(frozen=True)
class FrontSettings(Sweep):
    """Find the share f of the paper's law, by contacts against false alarms and time, beside `swept` and `none`.

    A finger of 2 N pulls R2 towards objects, and past them. Other pulls, steady and quick ones, are recorded without
    haptics and judged, as by `bench coverage` at P = 0.9. f is chosen on some scenes, for the most of: share of
    contacts prevented, minus share of the pulled time with a false alarm. Equal ones: the larger f. Then it is tried on
    the scenes kept apart.
    --quick: three f unless given, few scenes and links.
    """

    shares: Annotated[tuple[Share, ...], tyro.conf.arg(metavar="F...")] = _SHARES
    """f: share of the volume of all enlarged spheres whose overlap gives full strength. Default: four decades."""
    enlargements: tuple[EnlargementTime, ...] = ("always", "once")
    """When D_incr is computed."""
    links: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME...")] = ("0 ms", "200 ms", "400 ms")
    """Links of the finger of 2 N: 0 ms, 50 ms, 100 ms, 200 ms, 400 ms, each way."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("shares", "enlargements", "links"):
            values = getattr(self, name)
            if not values or len(set(values)) < len(values):
                raise ValueError(f"--{name} {' '.join(map(str, values))}: valid: one value or more, each once")
        if unknown := set(self.links) - LINKS.keys():
            raise ValueError(f"--links {' '.join(sorted(unknown))}: there is no such link; valid: {', '.join(LINKS)}")

    @property
    def papers(self) -> tuple[PaperSettings, ...]:
        """Settings of the paper's law that are tried."""
        shares = self.shares[1::2] if self.quick and self.shares == _SHARES else self.shares
        return tuple(PaperSettings(share, when) for when, share in product(self.enlargements, shares))


@dataclass(frozen=True)
class Pull:
    """Steady pull of 2 N that feels one law."""

    group: Group
    scene: str
    link: str
    law: TriedLaw
    paper: PaperSettings | None
    passes: bool
    """Whether there is nothing to touch"""


@dataclass(frozen=True)
class Judging:
    """Recorded pulls that are judged with all laws."""

    group: Group
    pulls: Pulls


def cells(settings: FrontSettings) -> Iterator[Pull | Judging]:
    """Yield the pulls for each scene, link, law and setting, and the recorded ones."""
    few, papers = (2 if settings.quick else None), settings.papers
    for group, (pull, link) in product(GROUPS, _PULLS[:few]):
        scenes = _AHEAD[group][:few] + _PASSED[group][:few]
        placed = tuple(Placement(scene) for scene in scenes)
        yield Judging(group, Pulls(pull, link, "empty", placed, (6, 4), (_PROBABILITY,), LAWS, papers, _JUDGED_S))
    for group, (law, paper) in product(GROUPS, with_papers(LAWS, papers)):
        links = settings.links[1:2] if settings.quick else settings.links
        for scene, link in product(_AHEAD[group][:few], links):
            yield Pull(group, scene, link, law, paper, passes=False)
        for scene in _PASSED[group][:few]:
            yield Pull(group, scene, "200 ms", law, paper, passes=True)


def run(cell: Pull | Judging, seed: int) -> Iterator[Row]:
    """Run one pull, or record and judge others."""
    if isinstance(cell, Judging):
        yield from ({"group": cell.group} | row for row in evaluate(cell.pulls, seed))
        return
    approach = Approach(
        frozen_scene(cell.scene),
        2.0,
        link=LINKS[cell.link],
        law=cell.law,
        paper=cell.paper or PaperSettings(),
        duration_s=_DURATION_S,
        seed=seed,
    )
    yield paper_figures(cell.paper) | pulled(PullRun(approach))


def pulled(pull: PullRun) -> Row:
    """Return whether and how fast the gripper touched something, and after how long it has gone 250 mm."""
    began_s = pull.arm()
    for _ in pull.go_on(began_s + pull.approach.duration_s):
        pass
    trace, onset = pull.trace(), pull.onset
    gone_m = (trace.speed_m_s[:-1] * (trace.time_s[1:] - trace.time_s[:-1])).cumsum()
    there = (gone_m >= _PASSED_M).nonzero()[0]
    return {
        "contact_speed_mm_s": None if onset is None else 1e3 * onset.closing_speed_m_s,
        "disarmed": pull.disarmed_because,
        "gone_s": float(trace.time_s[there[0]]) if len(there) else None,
    }


def points(table: Table, group: Group) -> Table:
    """Return a row for each law and setting: its figures over the scenes of one group.

    prevented: share of the contacts without haptics that do not occur. lost_s: mean time that 250 mm past objects take
    longer than without haptics, at most until 5 s.
    """
    mine = table.where(group=group)
    free = {_place(row): row for row in mine.where(law="none")}
    found = []
    for (law, enlargement, share), rows in mine.groups(*_VARIANT, "share"):
        # An unfinished sweep may lack the pull without haptics. A disarmed arm has prevented nothing.
        pulls = [row for row in rows if "passes" in row and _place(row) in free and row["disarmed"] is None]
        ahead = [row for row in pulls if not row["passes"] and free[_place(row)]["contact_speed_mm_s"] is not None]
        touched = [row["contact_speed_mm_s"] for row in ahead if row["contact_speed_mm_s"] is not None]
        lost = [_gone_s(row) - _gone_s(free[_place(row)]) for row in pulls if row["passes"]]
        covered, judged_s = rows.values("coverage"), sum(rows.values("judged_s"))
        found.append(
            {
                **{"law": law, "enlargement": enlargement, "share": share, "contacts": len(touched), "of": len(ahead)},
                "prevented": 1.0 - len(touched) / len(ahead) if ahead else None,
                "fastest_mm_s": max(touched, default=None),
                "covered": sum(covered) / len(covered) if covered else None,
                "alarms_per_min": 60.0 * sum(rows.values("alarms")) / judged_s if judged_s else None,
                "alarm_share": sum(rows.values("alarm_s")) / judged_s if judged_s else None,
                "lost_s": sum(lost) / len(lost) if lost else None,
            }
        )
    return Table(found)


def _place(row: Row) -> tuple[Any, ...]:
    return row["scene"], row.get("link"), row.get("passes"), row["seed"]


def _gone_s(row: Row) -> float:
    return _DURATION_S if row["gone_s"] is None else float(row["gone_s"])


def best(found: Iterable[Row]) -> Row | None:
    """Return the row with the greatest prevented - alarm_share; of equal ones that with the largest share f."""
    whole = [row for row in found if row["prevented"] is not None and row["alarm_share"] is not None]
    return max(whole, key=lambda row: (row["prevented"] - row["alarm_share"], row["share"] or 0.0), default=None)


def show(_: FrontSettings, table: Table) -> Iterator[RenderableType]:
    """Yield the fronts on both groups of scenes, and the chosen f of each variant on the scenes kept apart."""
    by_group = {group: points(table, group) for group in GROUPS}
    for group, found in by_group.items():
        title = {"chosen": "scenes on which f is chosen", "apart": "scenes kept apart from the choice"}[group]
        yield _shown(f"{title}: {', '.join(_AHEAD[group] + _PASSED[group])}", found)
    chosen = [row for row in _chosen(by_group["chosen"]) if row is not None]
    tried = [
        row for one in chosen for row in by_group["apart"].where(**{name: one[name] for name in (*_VARIANT, "share")})
    ]
    yield _shown("each law with its best f, on the scenes kept apart", tried)
    if (overall := best(row for row in chosen if row["share"] is not None)) is not None:
        when = PaperSettings(overall["share"], overall["enlargement"])
        yield f"best of the paper's laws on the scenes of the choice: {overall['law']}, {when}"


def _chosen(found: Table) -> list[Row | None]:
    return [best(rows) for _, rows in found.groups(*_VARIANT)]


def _shown(title: str, rows: Iterable[Row]) -> Shown:
    def text(value: float | None, form: str) -> str:
        return "" if value is None else format(value, form)

    entries = [
        (
            *(row["law"], row["enlargement"] or "", text(row["share"], "g"), f"{row['contacts']} of {row['of']}"),
            *(text(row["fastest_mm_s"], ".0f"), text(row["covered"], ".3f"), text(row["alarms_per_min"], ".1f")),
            *(text(row["alarm_share"], ".1%"), text(row["lost_s"], ".2f")),
        )
        for row in rows
    ]
    headings = ("law", "D_incr", "f", "contacts", "fastest, mm/s", "covered, P 0.9", "false alarms a minute")
    return shown(title, (*headings, "share of the time", "lost on 250 mm, s"), entries)


def draw(_: FrontSettings, table: Table, path: Path) -> None:
    """Draw contacts prevented against false alarms, and against time lost; a column for each group of scenes."""
    with figure(path, 2, 2, f"frozen {frozen_hash()}", figsize=(9.6, 7.2), sharey=True) as (drawn, panels):
        for column, group in enumerate(GROUPS):
            found = points(table, group)
            for row_number, (name, label) in enumerate(
                (("alarm_share", "false alarms, share of the time"), ("lost_s", "lost on 250 mm past objects, s"))
            ):
                axes = panels[row_number][column]
                for (law, when), rows in found.groups(*_VARIANT):
                    _curve(axes, [row for row in rows if None not in (row[name], row["prevented"])], name, law, when)
                axes.set(xlabel=label, ylim=(-0.03, 1.03))
                axes.grid(alpha=0.3)
            panels[0][column].set_title(
                {"chosen": "scenes on which f is chosen", "apart": "scenes kept apart"}[group], fontsize=9
            )
        for row_of_panels in panels:
            row_of_panels[0].set_ylabel("contacts prevented")
        drawn.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)


def _curve(axes: Any, rows: Sequence[Row], name: str, law: str, when: EnlargementTime | None) -> None:
    """Draw a law's points in the order of f, each with its f."""
    style = {"color": colour_of(law, LAWS), "marker": "o" if when else "*", "markersize": 4 if when else 12}
    label = law if when is None else f"{law}, D_incr {when}"
    axes.plot(
        [row[name] for row in rows],
        [row["prevented"] for row in rows],
        linestyle=_STYLES[when] if when else "",
        label=label,
        **style,
    )
    for row in rows if law == "paper" else ():  # those of the isotropic form are in the same order, and nearly as high
        if row["share"] is not None:
            axes.annotate(
                f"{row['share']:g}",
                (row[name], row["prevented"]),
                fontsize=6,
                xytext=(2, 2),
                textcoords="offset points",
            )


QUESTION = Question(
    "bench front",
    FrontSettings,
    cells,
    run,
    show,
    draw=draw,
    frozen=lambda _: frozen_hash(),
    prepare=compile_kernels,
)
