"""Layout of the terminal view. Curves grow with the terminal's width; a low terminal cuts the last lines."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from common.command.live_line import UNKNOWN, millimetres, percent
from common.command.live_view import LiveView, number
from common.command.words import lease_words, link_words, printable, words
from common.status.codes import Sight
from operator_side.controller.feel import SENSED_TRAVEL
from operator_side.viewing.facts import OperatorFacts

SILENT_AFTER_S: Final = 0.5
"""Age of the facts above which an alarm says that there is no news, in seconds"""
_KEPT: Final = 200
"""Number of facts in a curve (20 s at ten a second), and number of notes kept"""
_CURVES: Final = (("delay", "ms"), ("meets", ""), ("overlap", "mm³"), ("tick p99", "µs"))
_BLOCKS: Final = " ▁▂▃▄▅▆▇█"
_ALARM, _ARMED, _QUIET = "bold white on red", "bold black on bright_cyan", "reverse"
_FAINT, _TITLE, _PULL, _FELT = "bright_black", "bold", "bright_cyan", "bold bright_yellow"


class Screen:
    """Content of the terminal view: the newest facts, curves of recent ones, and notes."""

    def __init__(self) -> None:
        self.facts: OperatorFacts | None = None
        self.notes: deque[str] = deque(maxlen=_KEPT)
        self._history: deque[tuple[float, ...]] = deque(maxlen=_KEPT)

    def add(self, facts: OperatorFacts) -> None:
        """Show these facts, and append their figures to the curves; an unknown figure counts as 0."""
        self.facts, stiffest = facts, max(facts.l2.meets, facts.r2.meets)
        ahead = (None, None) if facts.scene is None else (facts.scene.overlap_mm3, facts.scene.tick_p99_us)
        self._history.append(tuple(number(value) or 0.0 for value in (facts.to_operator.newest_ms, stiffest, *ahead)))

    def lines(self, age_s: float, width: int) -> Group:
        """Draw all lines, at most `width` columns wide, the most important first. age_s: time since the last facts."""
        facts = self.facts
        view = LiveView() if facts is None else LiveView(facts.robot, facts.status)
        drawn: list[RenderableType] = [_banner(view, 0.0 if facts is None else age_s, width)]
        if facts is not None:
            triggers = Table.grid("", "", padding=(0, 2, 0, 0), expand=True)
            triggers.add_row(*(_trigger(facts, name, (width - 18) // 20) for name in ("L2", "R2")))
            past = zip(*self._history, strict=True)
            curves = (_curve(*curve, values, width) for curve, values in zip(_CURVES, past, strict=True))
            drawn += [*_standing(facts, view), triggers, *curves]
        rule = _line(("── notes, the newest first ".ljust(width, "─"), _FAINT))
        return Group(*drawn, rule, *(Text(printable(note)) for note in reversed(self.notes)))


def _line(*pieces: str | tuple[str, str], style: str = "") -> Text:
    """Make a line of plain or styled pieces, without the control characters that a peer's text may have."""
    styled = [(piece, "") if isinstance(piece, str) else piece for piece in pieces]
    safe = ((printable(text), look) for text, look in styled)
    return Text.assemble(*safe, style=style, no_wrap=True, overflow="ellipsis")


def _named(**said: object) -> Text:
    words = ((f"{name.replace('_', ' ')} ", (str(word or UNKNOWN), _TITLE), "   ") for name, word in said.items())
    return _line(*(piece for pieces in words for piece in pieces))


def _banner(view: LiveView, age_s: float, width: int) -> Text:
    """Draw the state in words and signs, readable without colour. Only an alarm fills the whole line with signs."""
    text = view.phase if view.reason is None else f"{view.phase}: {view.reason}"
    if (old := age_s > SILENT_AFTER_S) or view.alarm:
        return _line(f"!!! {f'NO NEWS for {age_s:.1f} s' if old else text} ".ljust(width, "!"), style=_ALARM)
    if (state := view.side.state) in ("armed", "disarmed"):
        text = f"{state.upper()}  {'' if view.phase == state else view.phase}".rstrip()
    sign = ">" if view.armed else "-" if state == "disarmed" else "."
    return _line(f"{3 * sign} {text} {3 * sign}".ljust(width), style=_ARMED if view.armed else _QUIET)


def _standing(facts: OperatorFacts, view: LiveView) -> list[Text]:
    """Draw figures of the link over the last second, of the nearest object, the target and the held object."""
    status, robot, known = view.operator, view.robot, view.scene
    feel = {} if status.feel in (None, Sight.SEEING) else {"feel": words(status.feel)}
    lease = lease_words(status.owner, reset_first=facts.reset_first)
    who = {"lease": lease, "hands": words(facts.hands), "controller": words(status.controller)}
    lines = [_named(link=link_words(status), **who, **feel)]
    for name, delay in (("to operator", facts.to_operator), ("to robot   ", facts.to_robot)):
        mean, p99, newest = (_figure(value, 5) for value in (delay.mean_ms, delay.p99_ms, delay.newest_ms))
        asked = delay.asked and f"  asked: {delay.asked}"
        lines.append(_line(f"{name}  mean {mean}  p99 {p99}  now {newest} ms{asked}"))
    rate, queue, lost = map(_figure, (known.rate_kbit_s, known.queue_ms, known.lost_percent))
    rates = {"rate": f"{rate} kbit/s", "queue": f"{queue} ms", "lost": f"{lost} %"}
    lines.append(_named(**rates, pictures=known.pictures, held_back=known.held_back))
    ages = (facts.round_trip_ms, facts.field_age_ms, robot.loop_age_ms)
    round_trip, field_age, loop_age = (f"{_figure(age)} ms" for age in ages)
    target = "none" if known.target is None else UNKNOWN
    if isinstance(known.target, str):
        centre = number(robot.target_mm) is None
        way = f"centre at {millimetres(status.target_centre_mm)}" if centre else f"at {millimetres(robot.target_mm)}"
        target = f"{known.target} {way}"
    nearest = f"{robot.nearest} at {millimetres(robot.nearest_mm)}" if robot.nearest else millimetres(robot.nearest_mm)
    asked = "" if facts.probability is None else f"   P {facts.probability:g}"
    enlarged_m = 0.0 if facts.screen is None else facts.screen.enlargement_m
    enlarged = UNKNOWN if enlarged_m == 0.0 else f"{_figure(1e3 * enlarged_m)} mm"
    grown = f"enlargement {enlarged}   rumble {_figure(facts.rumble)}"
    chosen = f"   speed {percent(status.speed_scale)} %   sticks {status.stick_frame}"
    if view.hindrance is not None:
        lines.append(_line("the arm does not follow: ", (view.hindrance, _FELT)))
    return [
        *(*lines, _named(round_trip=round_trip, field_age=field_age, loop_age=loop_age)),
        _named(nearest=nearest, target=target, holding=f"{view.holding or 'nothing'}{view.stands}"),
        _line(grown, chosen, asked, "" if status.haptics else "   haptics off"),
    ]


def _trigger(facts: OperatorFacts, name: str, cells: int) -> Group:
    """Draw a trigger: its travel, the strength of each zone, and the onset distances. cells: columns of one zone."""
    trigger, does = facts.l2 if name == "L2" else facts.r2, "advances" if facts.advancing == name else "retreats"
    raw, metres, cells = number(trigger.raw), number(trigger.needed_m), max(1, cells)
    led = number(trigger.course_stiffness)
    reached = math.ceil(min(1.0, max(0.0, (raw or 0.0) * SENSED_TRAVEL)) * cells * 10)
    rest = (UNKNOWN if raw is None else "·") * (cells * 10 - reached)
    behind = " behind" if round(1e3 * (metres or 0.0)) < 0 else " ahead"
    travel, free = percent(number(trigger.travel), 3), percent(number(trigger.free))
    meets = (f"{trigger.meets} of 8", _FELT if trigger.meets else "")
    return Group(
        _line((f"{name} {does}", _TITLE), f" pulled {travel} %, free to {free} %"),
        _line("finger  ", ("━" * (reached - 1) + "┫" * (reached > 0), _PULL), (rest, _FAINT)),
        _line("zones   ", *((f"{zone or '.'}".ljust(cells), _FELT if zone else "") for zone in trigger.zones)),
        _line("meets   ", meets, f"   course leads to {UNKNOWN if led is None else f'{8.0 * led:.0f}'}"),
        _line("D       ", (f"{UNKNOWN if metres is None else f'{1e3 * abs(metres):.0f}'} mm", _TITLE), behind),
        _line("fast mm ", " ".join(f"{1e3 * way:z.0f}" for way in trigger.fast_m) or UNKNOWN),
        _line("slow mm ", " ".join(f"{1e3 * way:z.0f}" for way in trigger.slow_m) or UNKNOWN),
    )


def _curve(name: str, unit: str, past: Sequence[float], width: int) -> Text:
    """Draw a figure's recent values as blocks, then its newest and its largest value.

    A block shows the largest of several consecutive values.
    """
    few, top = math.ceil(_KEPT / max(1, width - 34)), max(1.0, *past)
    highest = (max(past[max(0, end - few) : end]) for end in range(len(past), 0, -few))
    blocks = "".join(_BLOCKS[round(8 * max(0.0, value) / top)] for value in highest)[::-1].rjust(math.ceil(_KEPT / few))
    return _line(f"{name:<9}", (blocks, _PULL), f" {_figure(past[-1])} of {_figure(top)} {unit}")


def _figure(value: float | None, width: int = 0) -> str:
    """Format a figure, with fewer decimals the larger it is."""
    if (known := number(value)) is None:
        return f"{UNKNOWN:>{width}}"
    return f"{known:{width}.{0 if abs(known) >= 100.0 else 1 if abs(known) >= 1.0 else 2}f}"
