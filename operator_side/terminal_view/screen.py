"""A whole screen of one moment, in any size: bars and curves grow with the room, and a low screen loses its end."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from common.command.live_line import UNKNOWN, millimetres, percent
from common.command.live_view import LiveView, live_view, number, printable
from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL
from operator_side.facts import OperatorFacts, TriggerFacts

SILENT_AFTER_S: Final = 0.5
"""Facts that are older are said to be old."""
_KEPT: Final = 200
"""Facts that the curves show: 20 s of them, at ten a second."""
_CURVES: Final = (("delay", "ms"), ("stiffness", ""), ("overlap", "mm³"), ("tick p99", "µs"))
_NOTES_KEPT: Final = 40
_USUAL_HEIGHT: Final = 24
"""Lines of a usual terminal; bars and curves are taller with more."""
_ZONES: Final = 10
_LABEL: Final = 8
_BLOCKS: Final = " ▁▂▃▄▅▆▇█"
_ALARM, _ARMED, _QUIET = "bold white on red", "bold black on bright_cyan", "reverse"
_FAINT, _TITLE, _PULL, _FELT = "bright_black", "bold", "bright_cyan", "bold bright_yellow"


class Screen:
    """Remembers what the terminal shows."""

    def __init__(self) -> None:
        self.facts: OperatorFacts | None = None
        self.notes: deque[str] = deque(maxlen=_NOTES_KEPT)
        self._history: deque[tuple[float, ...]] = deque(maxlen=_KEPT)

    def add(self, facts: OperatorFacts) -> None:
        """Show these facts, and their figures in the curves; 0 for unknown."""
        self.facts, status, delay = facts, facts.status, number(facts.to_operator.newest_ms)
        known = [number(status.get(name)) or 0.0 for name in ("delay_ms", "overlap_mm3", "tick_p99_us")]
        stiffest = max(number(trigger.stiffness) or 0.0 for trigger in (facts.l2, facts.r2))
        self._history.append((known[0] if delay is None else delay, stiffest, *known[1:]))

    def lines(self, age_s: float, width: int, height: int) -> Group:
        """Draw at most `width` columns, the most important lines first. `age_s`: time since the facts came."""
        facts, view = self.facts, live_view({} if self.facts is None else self.facts.status)
        old = facts is not None and age_s > SILENT_AFTER_S
        drawn: list[RenderableType] = [_banner(view, f"NO NEWS for {age_s:.1f} s" if old else None, width)]
        if facts is not None:
            rows = max(1, min(4, 1 + (height - _USUAL_HEIGHT) // 6))
            triggers = Table.grid("", "", padding=(0, 2, 0, 0), expand=True)
            sides = {"L2": facts.l2, "R2": facts.r2}.items()
            half = (width - 2) // 2
            for both in zip(*(_trigger(*side, facts.advancing == side[0], half, rows) for side in sides), strict=True):
                triggers.add_row(*both)
            drawn += [*_standing(facts), triggers, *_ahead(facts, view), _curves(self._history, width, rows)]
        rule = _line(("── notes, the newest first ".ljust(width, "─"), _FAINT))
        return Group(*drawn, rule, *(Text(printable(note)) for note in reversed(self.notes)))


def _line(*pieces: str | tuple[str, str]) -> Text:
    """One line of plain or styled pieces; control characters of a peer do not reach the terminal."""
    styled = [(piece, "") if isinstance(piece, str) else piece for piece in pieces]
    return Text.assemble(*((printable(text), style) for text, style in styled), no_wrap=True, overflow="ellipsis")


def _banner(view: LiveView, alarm: str | None, width: int) -> Text:
    """The state in words and signs that need no colour; only an alarm fills the whole line."""
    text, fill, style = view.phase if view.reason is None else f"{view.phase}: {view.reason}", ".", _QUIET
    if alarm is not None or view.alarm:
        text, fill, style = alarm or text, "!", _ALARM
    elif view.state in ("armed", "disarmed"):
        text = f"{view.state.upper()}  {'' if view.phase == view.state else view.phase}".rstrip()
        fill, style = (">", _ARMED) if view.armed else ("-", _QUIET)
    banner = _line(f"{fill * 3} {text} {fill * 3}")
    banner.pad_right(max(0, width - banner.cell_len), fill if fill == "!" else " ")
    banner.stylize(style)
    return banner


def _standing(facts: OperatorFacts) -> list[Text]:
    """Link, lease, hands and controller; the link's directions, as measured over the last second and as asked for."""
    status = facts.status
    words = {"link": status.get("link"), "lease": status.get("owner"), "hands": facts.hands}
    words |= {name: status.get(name) for name in ("feel", "controller")}
    said = [piece for name, word in words.items() for piece in (f"{name} ", (str(word or UNKNOWN), _TITLE), "  ")]
    ages = {"round trip": facts.round_trip_ms, "field age": facts.field_age_ms, "loop age": status.get("loop_age_ms")}
    delays = (("to operator", facts.to_operator), ("to robot   ", facts.to_robot))
    return [
        _line(*said),
        *(
            _line(
                f"{name}  mean {_figure(delay.mean_ms, 5)}  p99 {_figure(delay.p99_ms, 5)}",
                f"  now {_figure(delay.newest_ms, 5)} ms{delay.asked and f'  asked: {delay.asked}'}",
            )
            for name, delay in delays
        ),
        _line("   ".join(f"{name} {_figure(number(age))} ms" for name, age in ages.items())),
    ]


def _trigger(name: str, trigger: TriggerFacts, advances: bool, width: int, rows: int) -> list[Text]:
    """The finger's place, the zones along its way, and the distances at which they stiffen."""
    cells = min(_LABEL, max(1, (width - _LABEL) // _ZONES))
    raw = number(trigger.raw)
    reached = 0 if raw is None else math.ceil(min(1.0, max(0.0, raw * SENSED_TRAVEL)) * cells * _ZONES)
    bars = _columns([strength / 8 for strength in trigger.zones], rows)
    blocks = "\n".join(
        " " * _LABEL + "".join((block * max(1, cells - 1)).ljust(cells) for block in row) for row in bars
    )
    metres, stiffness = number(trigger.needed_m), number(trigger.stiffness)
    return [
        _line(
            (f"{name} {'advances' if advances else 'retreats'}", _TITLE),
            f"  {percent(number(trigger.travel), 3)} %, free {percent(number(trigger.free))} %",
        ),
        _line(
            "finger  ",
            ("━" * (reached - 1) + "┫" * (reached > 0), _PULL),
            (("·" if raw is not None else UNKNOWN) * (cells * _ZONES - reached), _FAINT),
        ),
        Text(blocks, style=_FELT, no_wrap=True),
        _line("zones   ", "".join(f"{strength or '.'}".ljust(cells) for strength in trigger.zones)),
        _line(
            "meets   ", (f"{trigger.meets} of 8", _FELT if trigger.meets else ""), f"  stiffness {_figure(stiffness)}"
        ),
        _line("D       ", (f"{UNKNOWN if metres is None else f'{1e3 * metres:z.0f}'} mm", _TITLE), " ahead"),
        *(
            _line(f"{list_name} mm ", " ".join(f"{1e3 * way:z.0f}" for way in ways_m) or UNKNOWN)
            for list_name, ways_m in (("fast", trigger.fast_m), ("slow", trigger.slow_m))
        ),
    ]


def _ahead(facts: OperatorFacts, view: LiveView) -> list[Text]:
    """The nearest object, the target, and the thing in the hand."""
    target = UNKNOWN if view.has_target is None else "none"
    if view.has_target:
        by_centre = view.target_mm is None and view.target_centre_mm is not None
        way = f"centre at {millimetres(view.target_centre_mm)}" if by_centre else f"at {millimetres(view.target_mm)}"
        target = f"{facts.status.get('target')} {way}"
    pieces = {
        "nearest": f"{view.nearest or 'nearest thing'} at {millimetres(view.nearest_mm)}",
        "target": target,
        "holding": view.holding or "nothing",
    }
    return [
        _line(*(piece for name, said in pieces.items() for piece in (f"{name} ", (said, _TITLE), "   "))),
        _line(
            f"enlargement {_figure(number(facts.status.get('enlargement_mm')))} mm   rumble {_figure(facts.rumble)}",
            "" if facts.probability is None else f"   P {facts.probability:g}",
            "" if view.haptics else "   haptics off",
        ),
    ]


def _curves(history: Sequence[tuple[float, ...]], width: int, rows: int) -> Table:
    """Each figure over the last `_KEPT` facts: of several in one step the largest."""
    table, steps = Table.grid(padding=(0, 1, 0, 0)), max(1, width - 37)
    for _ in range(3):
        table.add_column(vertical="bottom", no_wrap=True)
    for which, (name, unit) in enumerate(_CURVES):
        values = [0.0] * steps
        for age, figures in enumerate(reversed(history)):
            step = steps - 1 - age * steps // _KEPT
            values[step] = max(values[step], figures[which])
        top = max(1.0, *values)
        drawn = Text("\n".join(_columns([value / top for value in values], rows)), style=_PULL)
        table.add_row(name, drawn, f"{_figure(history[-1][which], 6)} of {_figure(top)} {unit}")
    return table


def _columns(values: Sequence[float], rows: int) -> list[str]:
    """Columns from 0 to 1, one letter wide and `rows` high; the uppermost row first."""
    tops = [round(min(1.0, max(0.0, value)) * 8 * rows) for value in values]
    return ["".join(_BLOCKS[min(8, max(0, top - 8 * row))] for top in tops) for row in reversed(range(rows))]


def _figure(value: float | None, width: int = 0) -> str:
    """A figure with as many digits as say something."""
    known = number(value)
    if known is None:
        return f"{UNKNOWN:>{width}}"
    digits = 0 if abs(known) >= 100.0 else 1 if abs(known) >= 1.0 or known == 0.0 else 2
    return f"{known:{width}.{digits}f}"
