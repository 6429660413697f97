"""The page of a report: one HTML file with its pictures inside, for a reader who reviews such studies."""

from collections.abc import Iterable, Sequence
from html import escape
from importlib.metadata import version
from typing import Any, Final

from feelahead.study.balance import orders
from feelahead.study.protocol import Contrast
from feelahead.study.report import pictures, summaries
from feelahead.study.report.contrasts import Compared, effects_by
from feelahead.study.report.outcomes import OUTCOMES, Kind, Outcome, Tables, outcome_of
from feelahead.study.report.words import (
    ABSENT,
    effect_words,
    factor_of,
    in_unit,
    interval,
    models,
    named,
    number,
    p_value,
    sentence,
    settings_of,
)

_STYLE: Final = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; max-width: 62rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.6rem; margin-bottom: 0 } h2 { font-size: 1.2rem; margin-top: 2.2rem; border-bottom: 1px solid #ccc }
.table { overflow-x: auto } table { border-collapse: collapse; font-size: 13px; margin: .6rem 0 }
th, td { text-align: left; padding: .2rem .7rem .2rem 0; vertical-align: top; border-bottom: 1px solid #e5e5e5 }
td { font-variant-numeric: tabular-nums } img { max-width: 100% } figure { margin: 1rem 0 }
figcaption, .small { color: #555; font-size: 13px } .said { background: #fff3cd; padding: .6rem .9rem }
@media print { h2 { break-after: avoid } figure, tr { break-inside: avoid } }
"""
_PACKAGES: Final = ("statsmodels", "scipy", "numpy", "pandas")


def page(tables: Tables, found: tuple[Compared, ...]) -> str:
    """Return the page; the same tables give the same text."""
    name = escape(tables.protocol.name)
    sections = (
        _summary(tables, found),
        _contrasts(tables, found),
        _front(tables),
        _exploratory(tables),
        _questionnaires(tables),
        _order(tables),
        _flow(tables, found),
        _methods(tables),
        _limits(simulated=tables.simulated),
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{name}: report</title>'
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head>\n'
        f"<body>\n<h1>{name}</h1>\n{''.join(sections)}</body>\n</html>\n"
    )


def _summary(tables: Tables, found: tuple[Compared, ...]) -> str:
    asked = tables.protocol
    warning = "Simulated participants: no person took part. These figures say nothing about people."
    facts = (
        f"Protocol {asked.hash} · controller: {asked.controller} · {tables.analysed.participant.nunique()} of"
        f" {asked.participants} participants · {len(tables.analysed)} trials that count"
    )
    said = [sentence(one) for one in found]
    return (
        f'<p class="small">{escape(facts)}</p>'
        + (f'<p class="said">{warning}</p>' if tables.simulated else "")
        + "<h2>What was found</h2>"
        + (_listed(said) if said else "<p>The protocol plans no contrast.</p>")
    )


def _contrasts(tables: Tables, found: tuple[Compared, ...]) -> str:
    if not found:
        return ""
    head = ("contrast", "N, pairs", "values", "effect [95 %]", "model", "estimate [95 %]", "p", "p (Holm)", "p (exact)")
    rows = [_contrast_row(one) for one in found]
    notes = [f"{named(one.contrast)}: {one.fit.note}." for one in found if one.fit.note and one.effect.participants]
    notes += [f"{title}: {caution}." for title, caution in _cautions(found)]
    return (
        "<h2>Planned contrasts</h2>"
        + _table((*head, "Cohen’s d_z [95 %]"), rows)
        + _listed(notes)
        + _picture(
            pictures.persons(tables, found),
            "Each participant’s mean under both conditions, joined by a line; blue: the mean of all.",
        )
    )


def _contrast_row(one: Compared) -> tuple[str, ...]:
    outcome, effect, fit = outcome_of(one.contrast.outcome), one.effect, one.fit
    linear_share = outcome.kind is Kind.SHARE and fit.measure == "difference"
    factor = 100.0 if linear_share else 1.0
    estimate = ABSENT if fit.estimate is None else f"{fit.measure} {number(factor * fit.estimate)}"
    d_z = ABSENT if one.d_z is None else f"{number(one.d_z[0], 2)} {interval(*one.d_z[1:])}"
    return (
        named(one.contrast),
        f"{effect.participants}, {effect.pairs}",
        f"{in_unit(outcome, effect.value_first)} / {in_unit(outcome, effect.value_second)}",
        effect_words(outcome, effect),
        fit.model,
        f"{estimate} {interval(fit.low, fit.high, factor)}",
        *(p_value(p) for p in (fit.p, one.p_holm, one.p_exact)),
        d_z,
    )


def _cautions(found: Iterable[Compared]) -> list[tuple[str, str]]:
    outcomes = dict.fromkeys(outcome_of(one.contrast.outcome) for one in found)
    return [(outcome.title, outcome.caution) for outcome in outcomes if outcome.caution]


def _front(tables: Tables) -> str:
    cells = summaries.cells(tables)
    if cells.empty:
        return ""
    delays = sorted(cells.delay_ms.unique())
    rows = []
    for outcome in OUTCOMES.values():
        groups = cells[cells.outcome == outcome.name].groupby("condition", sort=False)
        for place, (condition, part) in enumerate(groups):
            shown = {row.delay_ms: _value(outcome, row) for row in part.itertuples()}
            title = f"{outcome.title} ({outcome.unit or 'number'})" if place == 0 else ""
            rows.append((title, condition, *(shown.get(delay, ABSENT) for delay in delays)))
    return (
        "<h2>Collisions against time</h2>"
        + _picture(
            pictures.front(cells, tuple(tables.protocol.conditions)),
            "Each mark is a condition at a delay; lines are 95 % intervals. Down and to the left is better.",
        )
        + "<h2>Every outcome by condition and delay</h2>"
        + '<p class="small">Means over participants of their means, with 95 % intervals over participants. A fastest'
        " contact is of trials with a contact alone. Where all participants have 0 or 100 %, the interval is exact.</p>"
        + _table(("outcome", "condition", *(f"{delay:g} ms" for delay in delays)), rows)
    )


def _exploratory(tables: Tables) -> str:
    shown: dict[Contrast, dict[str, str]] = {}
    for column, unit in (("delay_ms", " ms"), ("scene", "")):
        for contrast, level, effect in effects_by(tables, column):
            name = f"{level:g}{unit}" if unit else level
            shown.setdefault(contrast, {})[name] = effect_words(outcome_of(contrast.outcome), effect)
    if not shown:
        return ""
    levels = list(dict.fromkeys(level for one in shown.values() for level in one))
    rows = [(named(contrast), *(one.get(level, ABSENT) for level in levels)) for contrast, one in shown.items()]
    return (
        "<h2>The same effects by delay and by scene</h2>"
        + "<p>Exploratory: not planned, not tested, intervals uncorrected.</p>"
        + _table(("effect [95 %] of", *levels), rows)
    )


def _questionnaires(tables: Tables) -> str:
    frame = summaries.answers(tables)
    if frame.empty:
        return ""
    conditions = tuple(tables.protocol.conditions)
    rows = []
    for name, part in frame.groupby("outcome", sort=False):
        shown = {row.condition: _value(outcome_of(name), row) for row in part.itertuples()}
        rows.append((outcome_of(name).title, *(shown.get(one, ABSENT) for one in conditions)))
    ends = [f"“{item.text}”: 1 {item.low}, {item.points} {item.high}." for item in tables.protocol.items]
    return (
        "<h2>Workload and opinions</h2>"
        + _picture(pictures.answered(frame, tables.protocol), "Means over participants with 95 % intervals.")
        + _table(("item", *conditions), rows)
        + _listed((["NASA-TLX: 0 to 100, more is worse in each item."] if tables.protocol.tlx else []) + ends)
    )


def _order(tables: Tables) -> str:
    blocks, places = summaries.by_block(tables), summaries.places(tables)
    if blocks.empty:
        return ""
    rows = [(row[0], *map(str, row[1:])) for row in places.itertuples()]
    had = orders(tables.protocol, tables.analysed.participant.unique()).values()
    unequal = (
        f"<p>The orders of conditions are unequal: of those who count, {min(had)} to {max(had)} had each order.</p>"
        if min(had) < max(had)
        else ""
    )
    return (
        "<h2>Order, practice and fatigue</h2>"
        + _picture(pictures.blocks(blocks), "All conditions together, by block, with 95 % intervals.")
        + unequal
        + "<p>Participants who had each condition in each block, as it was run:</p>"
        + _table(("condition", *(f"block {number}" for number in places.columns)), rows)
    )


def _flow(tables: Tables, found: tuple[Compared, ...]) -> str:
    counts = [(what, str(count)) for what, count in summaries.flow(tables, found)]
    out = summaries.left_out(tables)
    rows = out.astype(object).where(out.notna(), "").astype(str).to_numpy()
    return (
        "<h2>Participants, faults and exclusions</h2>"
        + _table(("", "number"), counts)
        + (_table(tuple(out.columns), rows) if len(rows) else "<p>Each trial that was begun counts.</p>")
    )


def _methods(tables: Tables) -> str:
    asked = tables.protocol
    used = ", ".join(f"{package} {version(package)}" for package in _PACKAGES)
    conditions = [f"{name}: {settings_of(one)}" for name, one in asked.conditions.items()]
    design = (
        f"Conditions: {'; '.join(conditions)}. Delays, one way: {', '.join(f'{d:g} ms' for d in asked.delays_ms)}."
        f" Scenes: {', '.join(asked.scenes)}. Repetitions of each cell: {asked.trials}. Limit of a trial:"
        f" {asked.limit_s:g} s. Participants who withdraw: {asked.withdrawn}. Seed of the intervals: {asked.seed}."
    )
    return f"<h2>Design and analysis</h2><p>{escape(design)}</p>" + _listed([*models(asked), f"Computed with {used}."])


def _limits(*, simulated: bool) -> str:
    said = [
        "Contacts and distances are the simulation’s truth: a real arm has no such witness.",
        "A contrast without a difference is no evidence of equality; look at its interval.",
        "Participants feel whether there are haptics: the condition is hidden from the room, not from the hand.",
        "The tables hold no age, handedness or experience; report them from the list that you keep apart.",
    ]
    if simulated:
        said.insert(0, "Simulated participants do what their model says. Their number shows precision, not generality.")
    return "<h2>What this does not show</h2>" + _listed(said)


def _value(outcome: Outcome, row: Any) -> str:
    factor = factor_of(outcome)
    return f"{number(factor * row.value)} {interval(row.low, row.high, factor)}".removesuffix(f" {ABSENT}")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    cells = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>\n" for row in rows)
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    return f'<div class="table"><table><thead><tr>{titles}</tr></thead>\n<tbody>\n{cells}</tbody></table></div>\n'


def _listed(lines: Iterable[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>\n" for line in lines)
    return f"<ul>\n{items}</ul>\n" if items else ""


def _picture(address: str, caption: str) -> str:
    words = escape(caption)
    return f'<figure><img src="{address}" alt="{words}"><figcaption>{words}</figcaption></figure>\n'
