"""What came of approaches, in words and as a table."""

from collections.abc import Iterable, Sequence
from statistics import median

from rich.table import Table

from feelahead.approaches.approach import Approach, Outcome

Ended = tuple[Approach, Outcome]


def sentence(approach: Approach, outcome: Outcome) -> str:
    """One run in a line or two."""
    what = f"{approach.force_n:g} N in {approach.model.stem}, law {approach.law}: "
    if outcome.contact_speed_mm_s is not None:
        what += f"touches {outcome.contact_with} at {outcome.contact_speed_mm_s:.0f} mm/s after {outcome.ended_s:.2f} s"
    elif outcome.stops_at_mm is not None and outcome.way_left_mm is not None:
        what += f"stops {outcome.stops_at_mm:.1f} mm off ({outcome.way_left_mm:.1f} mm along the approach)"
    else:
        what += f"undecided after {outcome.ended_s:.1f} s: it still moves"
    return f"{what}; least gap {outcome.least_gap_mm:.1f} mm, reversals {outcome.reversals}"


def comparison(ended: Sequence[Ended]) -> Table:
    """A row for each scene, link and force, a column for each law; each cell over the seeds."""
    laws = list(dict.fromkeys((one.law, one.compensation) for one, _ in ended))
    several_effects = len({one.strongest_n for one, _ in ended}) > 1
    table = Table(
        title="contacts of runs, median contact speed; else where it stopped",
        caption="mm/s, or mm off, [least to greatest] over the seeds; ? undecided; R the most reversals",
    )
    for heading in ("scene", "link", "N", *(("effect, N",) if several_effects else ())):
        table.add_column(heading, overflow="fold")
    for law, _ in laws:
        table.add_column(law)
    cells: dict[tuple[str, str, float, float], dict[str, list[Outcome]]] = {}
    for one, outcome in ended:
        key = (one.model.stem, one.link or "none", one.force_n, one.strongest_n)
        cells.setdefault(key, {}).setdefault(one.law, []).append(outcome)
    for (scene, link, force_n, strongest_n), by_law in cells.items():
        effect = (f"{strongest_n:g}",) if several_effects else ()
        table.add_row(scene, link, f"{force_n:g}", *effect, *(cell(by_law.get(law, [])) for law, _ in laws))
    return table


def cell(outcomes: Sequence[Outcome]) -> str:
    """Some runs of one kind in a few words."""
    if not outcomes:
        return ""
    parts = []
    speeds = [one.contact_speed_mm_s for one in outcomes if one.contact_speed_mm_s is not None]
    stops = [one.stops_at_mm for one in outcomes if one.stops_at_mm is not None]
    undecided = sum(one.end == "undecided" for one in outcomes)
    if speeds:
        parts.append(f"{len(speeds)}/{len(outcomes)} at {_spread(speeds, 0)} mm/s")
    if stops:
        parts.append(f"{len(stops)}/{len(outcomes)} stop {_spread(stops, 1)} mm off")
    if undecided:
        parts.append(f"{undecided}/{len(outcomes)} ?")
    return ", ".join(parts) + f", R {max(one.reversals for one in outcomes)}"


def _spread(values: Iterable[float], digits: int) -> str:
    known = sorted(values)
    middle = f"{median(known):.{digits}f}"
    if len(known) == 1 or f"{known[0]:.{digits}f}" == f"{known[-1]:.{digits}f}":
        return middle
    return f"{middle} [{known[0]:.{digits}f} to {known[-1]:.{digits}f}]"
