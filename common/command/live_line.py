"""One line about what is going on, for a terminal of any width: whole facts only, the important ones first."""

from rich.cells import cell_len

from common.command.live_view import SLOW, LiveView

_BETWEEN = "  "
UNKNOWN = "–"
_QUEUE_MS = 5.0
_LOST_PERCENT = 0.05
"""Less of either is not worth a place."""
_LONGEST_NAME = 12
"""An object with a longer name is shown without it."""

_Fact = tuple[int, str]
"""(importance, text): 0 is the most important."""


def live_line(view: LiveView, width: int) -> str:
    """`view` in at most `width` columns: all facts, closer together where it is tight, or those that have room."""
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


def millimetres(value_mm: float | None, space: str = " ", digits: int = 0) -> str:
    """A distance, in metres from one metre on; nothing is nearer than 0."""
    if value_mm is None:
        return f"{UNKNOWN:>{digits}}{space}mm"
    value_mm = max(0.0, value_mm)
    if round(value_mm) >= 1000:
        return f"{value_mm / 1000.0:.1f}{space}m"
    return f"{value_mm:{digits}.0f}{space}mm"


def percent(share: float | None, digits: int = 0) -> str:
    """A share without its sign for per cent."""
    return f"{UNKNOWN:>{digits}}" if share is None else f"{100.0 * share:{digits}.0f}"


def _facts(view: LiveView) -> list[_Fact]:
    facts = [(0, view.phase)]
    if view.reason is not None:
        facts.append((1, view.reason))
    if view.real_time is not None and view.real_time < SLOW:
        facts.append((1, f"{percent(view.real_time)} % of real time"))
    pulled = f"{percent(view.l2.pulled)}/{percent(view.r2.pulled)}%"
    resist = f"{percent(view.l2.resists)}/{percent(view.r2.resists)}%"
    facts += [
        (2, f"L2/R2 pull {pulled} {'resist' if view.haptics else 'danger'} {resist}"),
        (4, f"near {millimetres(view.nearest_mm, '')}"),
        (3, _target(view)),
    ]
    if view.linked:
        facts.append((5, f"link {UNKNOWN if view.delay_ms is None else format(view.delay_ms, '.0f')}ms"))
        if view.queue_ms is not None and view.queue_ms >= _QUEUE_MS:
            facts.append((6, f"queue {view.queue_ms:.0f}ms"))
        if view.lost_percent is not None and view.lost_percent >= _LOST_PERCENT:
            facts.append((6, f"lost {view.lost_percent:.1f}%"))
    return facts


def _target(view: LiveView) -> str:
    if view.holding is not None:
        name = f" {view.holding}" if cell_len(view.holding) <= _LONGEST_NAME else ""
        return f"holding{name}{', it stands' if view.stands else ''}"
    if view.has_target is False:
        return "no target"
    if view.target_mm is None and view.target_centre_mm is not None:
        return f"target centre {millimetres(view.target_centre_mm, '')}"
    return f"target {millimetres(view.target_mm, '')}"
