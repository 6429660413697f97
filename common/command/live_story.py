"""Story of a run, for output to a file: one line of text for each change that matters to a person."""

import math
from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

from common.command.live_line import millimetres, percent
from common.command.live_view import LiveView, TriggerView, number
from common.status.codes import LinkState

SHORTEST_GAP_S = 0.4
"""Least time between two lines, in seconds, so that rapid changes to and fro give no lines; alarms are not delayed."""
_APART_AGAIN_MM = 8.0
"""Distance above which a touch counts as ended, in millimetres: hysteresis, as perception errs by millimetres."""


class Resistance(IntEnum):
    """Resistance of a trigger, in three levels."""

    NONE = 0
    SOME = 1
    FULL = 2


def next_resistance(before: Resistance, stiffness: float) -> Resistance:
    """Return the level for a stiffness of 0 to 1, with hysteresis after the level `before`.

    FULL begins at 0.95 and ends below 0.85; SOME begins at 0.05 and ends below 0.01.
    """
    if stiffness >= (0.85 if before is Resistance.FULL else 0.95):
        return Resistance.FULL
    return Resistance.SOME if stiffness >= (0.05 if before is Resistance.NONE else 0.01) else Resistance.NONE


class _State(NamedTuple):
    """State of a run as far as the story reports its changes."""

    phase: str = ""
    reason: str | None = None
    linked: bool = False
    armed: bool = False
    resistances: tuple[Resistance, ...] = (Resistance.NONE, Resistance.NONE)
    """Resistance of L2 and of R2"""
    touched: str | None = None
    holding: str | None = None
    stands: str = ""
    hindrance: str | None = None


class Story:
    """Writer of a run's story; it remembers the state that was last reported."""

    def __init__(self) -> None:
        self._state = self._reported = _State()
        self._start_s: float | None = None
        self._reported_s = -math.inf
        self._peaks = {"L2": 0.0, "R2": 0.0}
        """Largest stiffness of each trigger since a line last reported that it yields freely."""

    def tell(self, now_s: float, view: LiveView) -> str | None:
        """Return a line with the changes up to `now_s` and the time since the first call; None without changes."""
        if self._start_s is None:
            self._start_s = now_s
        for trigger in view.triggers:
            self._peaks[trigger.name] = max(self._peaks[trigger.name], trigger.resists or 0.0)
        self._state = state = _next_state(self._state, view)
        reported = self._reported
        alarm = view.alarm and state[:2] != reported[:2]
        if state == reported or (now_s - self._reported_s < SHORTEST_GAP_S and not alarm):
            return None
        self._reported, self._reported_s = state, now_s
        news = "; ".join(_news(reported, state, view, self._peaks))
        for trigger, resistance in zip(view.triggers, state.resistances, strict=True):
            if resistance is Resistance.NONE:
                self._peaks[trigger.name] = 0.0
        return f"{now_s - self._start_s:6.1f} s  {news}{_figures(view)}"


def _next_state(before: _State, view: LiveView) -> _State:
    touched, nearest_mm = before.touched, number(view.robot.nearest_mm)
    if nearest_mm is None or nearest_mm > _APART_AGAIN_MM:
        touched = None
    elif nearest_mm <= 0.0 and touched is None and view.robot.nearest is not None:
        touched = view.robot.nearest
    resistances = (
        next_resistance(was, one.resists or 0.0) for was, one in zip(before.resistances, view.triggers, strict=True)
    )
    linked = view.side.link is LinkState.UP
    seen = touched, view.holding, view.stands, view.hindrance
    return _State(view.phase, view.reason, linked, view.armed, tuple(resistances), *seen)


def _news(reported: _State, state: _State, view: LiveView, peaks: Mapping[str, float]) -> list[str]:
    news = []
    if state.linked and not reported.linked:
        news.append("link up")
    if state.armed and not reported.armed and state.phase != "armed":
        news.append("armed")
    if state[:2] != reported[:2]:
        news.append(state.phase if state.reason is None else f"{state.phase}: {state.reason}")
    for trigger, before, after in zip(view.triggers, reported.resistances, state.resistances, strict=True):
        if after is not before:
            news.append(_resistance(trigger, before, after, peaks[trigger.name], view.operator.haptics))
    if state.touched != reported.touched:
        news.append("touches nothing" if state.touched is None else f"touches {state.touched}, as perceived")
    if state.holding != reported.holding:
        news.append(f"lets go of {reported.holding}" if state.holding is None else f"holds {state.holding}")
    if state.stands and not reported.stands:
        news.append("the held object stands on something")
    if state.hindrance is not None and state.hindrance != reported.hindrance:
        news.append(f"the arm does not follow: {state.hindrance}")
    return news


def _resistance(trigger: TriggerView, before: Resistance, after: Resistance, peak: float, haptics: bool) -> str:
    """Describe the change that a finger on the trigger feels; without haptics the change that it would feel."""
    would, s = ("", "s") if haptics else ("would ", "")
    if after is Resistance.NONE:
        return f"{trigger.name} {would}yield{s} freely, after up to {percent(peak)} %"
    if after is Resistance.FULL:
        return f"{trigger.name} {would}resist{s} fully"
    does = "ease" if before is Resistance.FULL else "stiffen"
    return f"{trigger.name} {would}{does}{s} to {percent(trigger.resists)} %"


def _figures(view: LiveView) -> str:
    if not view.armed:
        return ""
    figures = [
        f"{name} pulled {percent(pulled)} %"
        for name, pulled, _ in view.triggers
        if pulled is not None and round(100.0 * pulled) > 0
    ]
    if number(view.robot.nearest_mm) is not None:
        figures.append(f"nearest {millimetres(view.robot.nearest_mm)}")
    if number(view.robot.target_mm) is not None and view.holding is None:
        figures.append(f"target {millimetres(view.robot.target_mm)}")
    return f"  ({', '.join(figures)})" if figures else ""
