"""A run as a few lines for a file: one whenever something changed that a person cares about, and else none."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum

from common.command.live_line import millimetres, percent
from common.command.live_view import LiveView, TriggerView

SHORTEST_GAP_S = 0.4
"""Between two lines, so that what goes to and fro is not told each time; an alarm does not wait."""
_APART_AGAIN_MM = 8.0
"""What was touched is touched until it is so far away: perception has an error of millimetres."""


class Resistance(IntEnum):
    """How much a trigger resists, in three words."""

    NONE = 0
    SOME = 1
    FULL = 2


def next_resistance(before: Resistance, stiffness: float) -> Resistance:
    """The word for a stiffness of 0 to 1, with hysteresis: none below 0.01, some from 0.05, full from 0.95 to 0.85."""
    if stiffness >= (0.85 if before is Resistance.FULL else 0.95):
        return Resistance.FULL
    return Resistance.SOME if stiffness >= (0.05 if before is Resistance.NONE else 0.01) else Resistance.NONE


@dataclass(frozen=True)
class _State:
    """What is worth a line when it changes."""

    phase: str = ""
    reason: str | None = None
    linked: bool = False
    armed: bool = False
    l2: Resistance = Resistance.NONE
    r2: Resistance = Resistance.NONE
    touched: str | None = None
    holding: str | None = None
    stands: bool = False


class Story:
    """Remembers what has been told."""

    def __init__(self) -> None:
        self._state = self._told = _State()
        self._start_s: float | None = None
        self._told_s = -math.inf
        self._peaks = {"L2": 0.0, "R2": 0.0}
        """The most that each trigger resisted since it last yielded."""

    def tell(self, now_s: float, view: LiveView) -> str | None:
        """A line with what is new at `now_s` and the time since the first call; None while there is nothing."""
        if self._start_s is None:
            self._start_s = now_s
        for name, trigger in (("L2", view.l2), ("R2", view.r2)):
            self._peaks[name] = max(self._peaks[name], trigger.resists or 0.0)
        self._state = _next_state(self._state, view)
        state, told = self._state, self._told
        alarm = view.alarm and (state.phase, state.reason) != (told.phase, told.reason)
        if state == told or (now_s - self._told_s < SHORTEST_GAP_S and not alarm):
            return None
        self._told, self._told_s = state, now_s
        news = "; ".join(_news(told, state, view, self._peaks))
        for name, resists in (("L2", state.l2), ("R2", state.r2)):
            if resists is Resistance.NONE:
                self._peaks[name] = 0.0
        return f"{now_s - self._start_s:6.1f} s  {news}{_figures(view)}"


def _next_state(before: _State, view: LiveView) -> _State:
    touched = before.touched
    if view.nearest_mm is None or view.nearest_mm > _APART_AGAIN_MM:
        touched = None
    elif view.nearest_mm <= 0.0 and touched is None:
        touched = view.nearest
    return replace(
        before,
        phase=view.phase,
        reason=view.reason,
        linked=view.linked is True,
        armed=view.armed,
        l2=next_resistance(before.l2, view.l2.resists or 0.0),
        r2=next_resistance(before.r2, view.r2.resists or 0.0),
        touched=touched,
        holding=view.holding,
        stands=view.stands,
    )


def _news(told: _State, state: _State, view: LiveView, peaks: Mapping[str, float]) -> list[str]:
    news = []
    if state.linked and not told.linked:
        news.append("link up")
    if state.armed and not told.armed and state.phase != "armed":
        news.append("armed")
    if (state.phase, state.reason) != (told.phase, told.reason):
        news.append(state.phase if state.reason is None else f"{state.phase}: {state.reason}")
    for name, before, after, trigger in (("L2", told.l2, state.l2, view.l2), ("R2", told.r2, state.r2, view.r2)):
        if after is not before:
            news.append(_resistance(name, before, after, trigger, peaks[name], view.haptics))
    if state.touched != told.touched:
        news.append("touches nothing" if state.touched is None else f"touches {state.touched}, as perceived")
    if state.holding != told.holding:
        news.append(f"lets go of {told.holding}" if state.holding is None else f"holds {state.holding}")
    if state.stands and not told.stands:
        news.append("what is held stands")
    return news


def _resistance(
    name: str, before: Resistance, after: Resistance, trigger: TriggerView, peak: float, haptics: bool
) -> str:
    """What a finger on the trigger notices; without haptics, what it would."""
    would, share = ("" if haptics else "would "), f"{percent(trigger.resists)} %"
    if after is Resistance.NONE:
        return f"{name} {would}yield{'s' if haptics else ''} freely, after up to {percent(peak)} %"
    if after is Resistance.FULL:
        return f"{name} {would}resist{'s' if haptics else ''} fully"
    return f"{name} {would}{'ease' if before is Resistance.FULL else 'stiffen'}{'s' if haptics else ''} to {share}"


def _figures(view: LiveView) -> str:
    if not view.armed:
        return ""
    figures = [
        f"{name} pulled {percent(trigger.pulled)} %"
        for name, trigger in (("L2", view.l2), ("R2", view.r2))
        if trigger.pulled is not None and round(100.0 * trigger.pulled) > 0
    ]
    if view.nearest_mm is not None:
        figures.append(f"nearest {millimetres(view.nearest_mm)}")
    if view.target_mm is not None and view.holding is None:
        figures.append(f"target {millimetres(view.target_mm)}")
    return f"  ({', '.join(figures)})" if figures else ""
