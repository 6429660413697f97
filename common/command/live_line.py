"""Live line of a run, for a terminal of any width: if the line is too long, less important facts are left out."""

from rich.cells import cell_len

from common.command.live_view import SLOW, LiveView, number
from common.status.codes import LinkState

_BETWEEN = "  "
UNKNOWN = "–"
_QUEUE_MS = 5.0
_LOST_PERCENT = 0.05
"""Least loss that is shown, in per cent; _QUEUE_MS is the least queueing delay that is shown, in milliseconds."""
_LONGEST_NAME = 12
"""Longest name of an object that is shown, in columns."""

_Fact = tuple[int, str]
"""(importance, text): 0 is the most important."""


def live_line(view: LiveView, width: int) -> str:
    """Return `view` as a line of at most `width` columns: all facts, spaced closer if needed, or the most important."""
    facts = _facts(view)
    for between in (_BETWEEN, " "):
        line = _BETWEEN.join((facts[0][1], between.join(text for _, text in facts[1:])))
        if cell_len(line) <= width:
            return line
    left, kept = width + len(_BETWEEN), set()
    for fact in sorted(facts):
        needed = cell_len(fact[1]) + len(_BETWEEN)
        if needed <= left:
            left -= needed
            kept.add(fact)
    return _BETWEEN.join(fact[1] for fact in facts if fact in kept)


def millimetres(value_mm: float | None, space: str = " ") -> str:
    """Return a distance as text: in millimetres, from 1000 mm in metres; 0 if negative."""
    if (known_mm := number(value_mm)) is None:
        return f"{UNKNOWN}{space}mm"
    known_mm = max(0.0, known_mm)
    return f"{known_mm / 1000.0:.1f}{space}m" if round(known_mm) >= 1000 else f"{known_mm:.0f}{space}mm"


def percent(share: float | None, digits: int = 0) -> str:
    """Return a share in per cent as text of at least `digits` columns, without the sign %."""
    return f"{UNKNOWN:>{digits}}" if share is None else f"{100.0 * share:{digits}.0f}"


def _facts(view: LiveView) -> list[_Fact]:
    facts = [(0, view.phase)]
    if view.reason is not None:
        facts.append((1, view.reason))
    if view.hindrance is not None:
        facts.append((1, view.hindrance))
    if (real_time := number(view.robot.real_time)) is not None and real_time < SLOW:
        facts.append((1, f"{percent(real_time)} % of real time"))
    if view.operator.speed_scale != 1.0:
        facts.append((2, f"speed {percent(view.operator.speed_scale)}%"))
    if view.operator.stick_frame != "tool":
        facts.append((2, f"sticks: {view.operator.stick_frame}"))
    pulled = "/".join(percent(trigger.pulled) for trigger in view.triggers)
    resist = "/".join(percent(trigger.resists) for trigger in view.triggers)
    facts += [
        (2, f"L2/R2 pull {pulled}% {'resist' if view.operator.haptics else 'danger'} {resist}%"),
        (4, f"near {millimetres(view.robot.nearest_mm, '')}"),
        (3, _target(view)),
    ]
    if view.side.link is LinkState.UP:
        delay_ms, queue_ms, lost = map(number, (view.side.delay_ms, view.scene.queue_ms, view.scene.lost_percent))
        facts.append((5, f"link {UNKNOWN if delay_ms is None else format(delay_ms, '.0f')}ms"))
        if queue_ms is not None and queue_ms >= _QUEUE_MS:
            facts.append((6, f"queue {queue_ms:.0f}ms"))
        if lost is not None and lost >= _LOST_PERCENT:
            facts.append((6, f"lost {lost:.1f}%"))
    return facts


def _target(view: LiveView) -> str:
    if view.holding is not None:
        return f"holding{f' {view.holding}' if cell_len(view.holding) <= _LONGEST_NAME else ''}{view.stands}"
    if view.scene.target is None:
        return "no target"
    if number(view.robot.target_mm) is None and (centre_mm := number(view.operator.target_centre_mm)) is not None:
        return f"target centre {millimetres(centre_mm, '')}"
    return f"target {millimetres(view.robot.target_mm, '')}"
