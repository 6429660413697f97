"""A whole screen of one moment, for any size: what matters most stays, and what is large grows with the room."""

from collections import deque
from textwrap import wrap
from typing import Final, NamedTuple

from common.command.live_view import LiveView, live_view
from operator_side.facts import DelayFacts, OperatorFacts
from operator_side.terminal_view.figures import millimetres, plain, share
from operator_side.terminal_view.history import Curve, History, number
from operator_side.terminal_view.lines import Line, Look, Ranked, beside, fitted, line, most_important
from operator_side.terminal_view.signs import Signs
from operator_side.terminal_view.trigger_part import trigger_part

SILENT_AFTER_S: Final = 0.5
"""So long after the newest facts, what is shown is said to be old."""
_USUAL_HEIGHT: Final = 24
_USUAL_NOTES: Final = 3
_TALLEST: Final = 4
_CURVE_LABEL: Final = 10
_CURVE_FIGURES: Final = 26


class Moment(NamedTuple):
    """What is drawn."""

    facts: OperatorFacts | None
    """None before the first."""
    age_s: float
    """Since they came."""
    history: History
    notes: deque[str]
    """The newest last."""


def screen(moment: Moment, signs: Signs, width: int, height: int) -> list[Line]:
    """Exactly `height` lines of exactly `width` columns."""
    extra = max(0, height - _USUAL_HEIGHT)
    # Each of the four curves grows by a row, then the zones, and so on; what is left is for notes.
    taller = min(_TALLEST - 1, extra // 6)
    rows = 1 + taller
    shown = _shown(moment, signs, width, rows, _USUAL_NOTES + extra - 5 * taller)
    chosen = [fitted(given, width, signs.cut) for given in most_important(shown, height)]
    blank = fitted((), width)
    return [*chosen, *[blank] * (height - len(chosen))]


def _shown(moment: Moment, signs: Signs, width: int, rows: int, notes: int) -> list[Ranked]:
    facts = moment.facts
    view = live_view({} if facts is None else facts.status)
    lines = [Ranked(0, _banner(moment, view, signs, width))]
    if facts is not None:
        lines += [Ranked(0, _standing(facts, signs)), *_link(facts, signs)]
        names = [f"{name} {'advances' if facts.advancing == name else 'retreats'}" for name in ("L2", "R2")]
        half = (width - 2) // 2
        left, right = (
            trigger_part(name, trigger, signs, half, rows)
            for name, trigger in zip(names, (facts.l2, facts.r2), strict=True)
        )
        lines += beside(left, right, width, signs.cut)
        lines += _ahead(facts, view, signs)
        columns = max(1, width - _CURVE_LABEL - _CURVE_FIGURES)
        for rank, curve in enumerate(moment.history.curves(columns)):
            lines += _curve(curve, signs, rows, 2 + rank)
    else:
        notes = _USUAL_HEIGHT
    lines.append(Ranked(5, line((_rule("notes", signs, width), Look.FAINT))))
    newest = [part for text in list(moment.notes)[-notes:] for part in wrap(text, width, subsequent_indent="  ")][
        -notes:
    ]
    # The newest are worth most.
    lines += [Ranked(min(6, len(newest) - place), line(signs.words(text))) for place, text in enumerate(newest)]
    return lines


def _banner(moment: Moment, view: LiveView, signs: Signs, width: int) -> Line:
    """What is going on, in words and signs that need no colour."""
    facts, reason = moment.facts, f": {view.reason}" if view.reason is not None else ""
    state = None if facts is None else facts.status.get("state")
    if facts is not None and moment.age_s > SILENT_AFTER_S:
        text, fill, look = f"NO NEWS for {min(moment.age_s, 9999.0):.1f} s", "!", Look.ALARM
    elif view.alarm:
        text, fill, look = f"{view.phase.upper()}{reason}", "!", Look.ALARM
    elif state == "armed":
        text, fill, look = f"ARMED  {'' if view.phase == 'armed' else view.phase}".rstrip(), ">", Look.GOOD
    elif state == "disarmed":
        text, fill, look = f"DISARMED  {'' if view.phase == 'disarmed' else view.phase}".rstrip(), "-", Look.QUIET
    else:
        text, fill, look = f"{view.phase}{reason}", ".", Look.QUIET
    begun = fitted(line((f"{fill * 3} {signs.words(text)} {fill * 3}", look)), width, signs.cut)
    # Only an alarm fills the whole line.
    *words, rest = begun
    if rest.text.isspace() and words:
        rest = rest._replace(text=fill * len(rest.text) if look is Look.ALARM else rest.text, look=look)
    return (*words, rest)


def _standing(facts: OperatorFacts, signs: Signs) -> Line:
    """Link, lease, controller and hands."""
    status = facts.status
    said = [
        ("link", status.get("link")),
        ("lease", status.get("owner")),
        ("hands", facts.hands),
        ("feel", status.get("feel")),
        ("controller", status.get("controller")),
    ]
    return line(*(piece for name, word in said for piece in (f"{name} ", (_word(word, signs), Look.TITLE), "  ")))


def _link(facts: OperatorFacts, signs: Signs) -> list[Ranked]:
    """Each direction: what was measured over the last second, and what was asked for."""
    loop = number(facts.status.get("loop_age_ms"))
    ages = [("round trip", facts.round_trip_ms), ("field age", facts.field_age_ms)]
    if loop is not None:
        ages.append(("loop age", loop))
    return [
        Ranked(1, _direction("to operator", facts.to_operator, signs)),
        Ranked(2, _direction("to robot", facts.to_robot, signs)),
        Ranked(1, line(*(f"{name} {plain(value, signs)} ms   " for name, value in ages))),
    ]


def _direction(name: str, delay: DelayFacts, signs: Signs) -> Line:
    figures = (("mean", delay.mean_ms), ("p99", delay.p99_ms), ("now", delay.newest_ms))
    asked = f"  asked: {signs.words(delay.asked)}" if delay.asked else ""
    return line(f"{name:<11}", *(f" {label} {plain(value, signs, 5)} " for label, value in figures), "ms", asked)


def _ahead(facts: OperatorFacts, view: LiveView, signs: Signs) -> list[Ranked]:
    """What is near, what is wanted, and what is in the hand."""

    def metres(value_mm: float | None) -> str:
        return millimetres(None if value_mm is None else 1e-3 * value_mm, signs)

    nearest = signs.words(view.nearest or "nearest thing")
    target = {None: signs.unknown, False: "none", True: _word(facts.status.get("target"), signs)}[view.has_target]
    to_target = f"at {metres(view.target_mm)}"
    if view.target_mm is None and view.target_centre_mm is not None:
        to_target = f"centre at {metres(view.target_centre_mm)}"
    enlargement = number(facts.status.get("enlargement_mm"))
    spread = "" if enlargement is None else f"enlargement {plain(enlargement, signs)} mm   "
    rumble = share(facts.rumble)
    return [
        Ranked(
            0,
            line(
                "nearest ",
                (f"{nearest} at {metres(view.nearest_mm)}", Look.TITLE),
                "   target ",
                (f"{target} {to_target}" if view.has_target else target, Look.TITLE),
                "   holding ",
                (signs.words(view.holding or "nothing"), Look.TITLE),
            ),
        ),
        Ranked(
            4,
            line(
                spread,
                f"rumble {plain(rumble, signs)}",
                "" if facts.probability is None else f"   P {facts.probability:g}",
                "   haptics off" if not view.haptics else "",
            ),
        ),
    ]


def _curve(curve: Curve, signs: Signs, rows: int, rank: int) -> list[Ranked]:
    """One figure over the last seconds, `rows` high, named in its lowest row."""
    drawn = signs.columns((None if value is None else value / curve.top for value in curve.values), rows)
    figures = f" {plain(curve.newest, signs, 6)} of {plain(curve.top, signs)} {signs.words(curve.unit)}"
    if signs.plain:
        figures = figures.replace("mm?", "mm3").replace("?s", "us")
    return [
        Ranked(
            rank if row == rows - 1 else 7,
            line(
                f"{curve.name if row == rows - 1 else '':<{_CURVE_LABEL}}",
                (letters, Look.PULL),
                figures if row == rows - 1 else "",
            ),
        )
        for row, letters in enumerate(drawn)
    ]


def _rule(name: str, signs: Signs, width: int) -> str:
    return f"{signs.rule * 2} {name} ".ljust(width, signs.rule)


def _word(value: object, signs: Signs) -> str:
    return signs.unknown if value is None else signs.words(str(value))
