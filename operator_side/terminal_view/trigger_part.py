"""One trigger in a column of a screen: where the finger is, what lies along its way, and from how far it is felt."""

from typing import Final

from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL
from operator_side.facts import TriggerFacts
from operator_side.terminal_view.figures import millimetres, percent, share
from operator_side.terminal_view.history import number
from operator_side.terminal_view.lines import Look, Ranked, line
from operator_side.terminal_view.signs import Signs

_ZONES: Final = 10
_LABEL: Final = 7
_WIDEST_ZONE: Final = 8
_STRONGEST: Final = 8


def trigger_part(name: str, trigger: TriggerFacts, signs: Signs, width: int, rows: int) -> list[Ranked]:
    """The trigger's lines in `width` columns; its zones are `rows` high."""
    zone = min(_WIDEST_ZONE, max(1, (width - _LABEL) // _ZONES))
    travel, meets = share(trigger.travel), _strength(trigger.meets)
    raw = share(trigger.raw)
    reached, rest = signs.filled(None if raw is None else raw * SENSED_TRAVEL, zone * _ZONES)
    strengths = [_strength(strength) for strength in trigger.zones]
    bars = [
        (row[:_ZONES], upper)
        for upper, row in enumerate(signs.columns([strength / _STRONGEST for strength in strengths], rows))
    ]
    felt = Look.FELT if meets else Look.PLAIN
    return [
        Ranked(
            0, line((name, Look.TITLE), f"  {percent(travel, signs):>5}, free {percent(share(trigger.free), signs)}")
        ),
        Ranked(1, line("finger ", (reached, Look.PULL), (rest, Look.FAINT))),
        *(
            Ranked(
                1 if upper == rows - 1 else 2,
                line(" " * _LABEL, ("".join(_wide(sign, zone) for sign in row), Look.FELT)),
            )
            for row, upper in bars
        ),
        Ranked(0, line("zones  ", "".join(_wide_number(strength, zone) for strength in strengths))),
        Ranked(0, line("meets  ", (f"{meets} of {_STRONGEST}", felt), f"  stiffness {_two(trigger.stiffness, signs)}")),
        Ranked(0, line("D      ", (millimetres(trigger.needed_m, signs), Look.TITLE), " ahead")),
        Ranked(3, line("fast   ", _ways(trigger.fast_m, signs, width - _LABEL))),
        Ranked(4, line("slow   ", _ways(trigger.slow_m, signs, width - _LABEL))),
    ]


def _strength(strength: int) -> int:
    return min(_STRONGEST, max(0, strength))


def _two(value: float | None, signs: Signs) -> str:
    known = number(value)
    return signs.unknown if known is None else f"{known:.2f}"


def _wide(sign: str, cells: int) -> str:
    """A zone's column, with a gap to the next where there is room."""
    return sign * (cells - 1) + " " if cells > 1 else sign


def _wide_number(strength: int, cells: int) -> str:
    return f"{strength or '.':<{cells}}"


def _ways(ways_m: tuple[float, ...], signs: Signs, width: int) -> str:
    """The ways at which the strengths begin, in mm: all of them, or where there is no room the first and the last."""
    known = [f"{1e3 * way:.0f}" for way in ways_m if number(way) is not None]
    if not known:
        return signs.unknown
    whole = f"{' '.join(known)} mm"
    return whole if len(whole) <= width else f"{known[0]} to {known[-1]} mm"
