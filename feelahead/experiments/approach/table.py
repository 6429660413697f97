"""What came of approaches, in words and as a table."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median

from rich.table import Table
from rich.text import Text

from feelahead.lab.approaches.approach import Approach
from feelahead.lab.approaches.laws import in_words
from feelahead.lab.approaches.outcome import Outcome

Ended = tuple[Approach, Outcome]
_FARTHEST_MM = 1000.0
"""Farther than this nobody looks."""


def sentence(approach: Approach, outcome: Outcome) -> str:
    """One run in a line or two."""
    what = f"{approach.force_n:g} N in {approach.model.stem}, law {in_words(approach.law)}: "
    if outcome.why is not None:
        return f"{what}{outcome.end}: {outcome.why}"
    if outcome.contact_speed_mm_s is not None:
        speed = round(outcome.contact_speed_mm_s)
        what += f"touches {outcome.contact_with} at {speed} mm/s after {outcome.ended_s:.2f} s"
    elif outcome.stops_at_mm is not None and outcome.way_left_mm is not None:
        what += f"stops {_gap(outcome.stops_at_mm)} off ({_gap(outcome.way_left_mm)} along the approach)"
    else:
        what += f"undecided after {outcome.ended_s:.1f} s: it still moves"
    return f"{what}; least gap {_gap(outcome.least_gap_mm)}, reversals {outcome.reversals}"


def _gap(gap_mm: float) -> str:
    return f"{gap_mm:.1f} mm" if gap_mm < _FARTHEST_MM else f"more than {_FARTHEST_MM:g} mm"


def comparison(ended: Sequence[Ended]) -> Table:
    """A row for each scene, link and force, a column for each law; each cell over the seeds."""
    laws = list(dict.fromkeys(one.law for one, _ in ended))
    several_effects = len({one.strongest_n for one, _ in ended}) > 1
    names = scene_names([one.model for one, _ in ended])
    table = Table(
        title="contacts of runs, median contact speed; else where it stopped",
        caption=Text("mm/s, or mm off, [least to greatest] over the seeds; ? undecided; R the most reversals"),
    )
    for heading in ("scene", "link", "N", *(("effect, N",) if several_effects else ())):
        table.add_column(heading, overflow="fold")
    for law in laws:
        table.add_column(in_words(law))
    cells: dict[tuple[Path, str, float, float], dict[str, list[Outcome]]] = {}
    for one, outcome in ended:
        key = (one.model, one.link or "none", one.force_n, one.strongest_n)
        cells.setdefault(key, {}).setdefault(one.law, []).append(outcome)
    for (scene, link, force_n, strongest_n), by_law in cells.items():
        effect = (f"{strongest_n:g}",) if several_effects else ()
        row = (names[scene], link, f"{force_n:g}", *effect, *(cell(by_law.get(law, [])) for law in laws))
        table.add_row(*(Text(text) for text in row))
    return table


def scene_names(models: Iterable[Path]) -> dict[Path, str]:
    """What each scene is called: its file's name, or the whole path where several have that name."""
    known = list(dict.fromkeys(models))
    stems = [model.stem for model in known]
    return {model: model.stem if stems.count(model.stem) == 1 else str(model) for model in known}


def cell(outcomes: Sequence[Outcome]) -> str:
    """Some runs of one kind in a few words."""
    if not outcomes:
        return ""
    parts = []
    speeds = [one.contact_speed_mm_s for one in outcomes if one.contact_speed_mm_s is not None]
    stops = [one.stops_at_mm for one in outcomes if one.stops_at_mm is not None]
    if speeds:
        parts.append(f"{len(speeds)}/{len(outcomes)} at {_spread(speeds, 0)} mm/s")
    if stops:
        parts.append(f"{len(stops)}/{len(outcomes)} stop {_spread(stops, 1)} mm off")
    for end, shown in (("undecided", "?"), ("disarmed", "disarmed"), ("failed", "failed")):
        if count := sum(one.end == end for one in outcomes):
            parts.append(f"{count}/{len(outcomes)} {shown}")
    return ", ".join(parts) + f", R {max(one.reversals for one in outcomes)}"


def _spread(values: Iterable[float], digits: int) -> str:
    known = sorted(values)
    middle = f"{median(known):.{digits}f}"
    if len(known) == 1 or f"{known[0]:.{digits}f}" == f"{known[-1]:.{digits}f}":
        return middle
    return f"{middle} [{known[0]:.{digits}f} to {known[-1]:.{digits}f}]"
