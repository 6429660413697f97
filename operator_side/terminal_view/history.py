"""The last seconds of a few figures, for small curves."""

from collections import deque
from typing import Final, NamedTuple

from common.command.live_view import Value
from operator_side.facts import OperatorFacts

SPAN_S: Final = 20.0
_MOST: Final = 2000


class Curve(NamedTuple):
    """One figure over the last `SPAN_S`, the newest last; None where nothing is known."""

    name: str
    unit: str
    values: list[float | None]
    newest: float | None
    top: float
    """What the curve's full height means."""


class _Sample(NamedTuple):
    taken_s: float
    figures: tuple[float | None, ...]


_NAMES: Final = (("delay", "ms"), ("stiffness", ""), ("overlap", "mm³"), ("tick p99", "µs"))


class History:
    """Remembers what `add` is given for `SPAN_S`."""

    def __init__(self) -> None:
        self._samples: deque[_Sample] = deque(maxlen=_MOST)

    def add(self, facts: OperatorFacts) -> None:
        """Keep the figures of `facts`; a clock that has gone back, as in a replay, begins anew."""
        if (now_s := number(facts.now_s)) is None:
            return
        if self._samples and now_s < self._samples[-1].taken_s:
            self._samples.clear()
        delay, felt = number(facts.to_operator.newest_ms), [number(facts.l2.stiffness), number(facts.r2.stiffness)]
        self._samples.append(
            _Sample(
                now_s,
                (
                    number(facts.status.get("delay_ms")) if delay is None else delay,
                    max((value for value in felt if value is not None), default=None),
                    number(facts.status.get("overlap_mm3")),
                    number(facts.status.get("tick_p99_us")),
                ),
            )
        )
        while self._samples[0].taken_s < now_s - SPAN_S:
            self._samples.popleft()

    def curves(self, columns: int) -> list[Curve]:
        """All of them, each in `columns` steps: of several samples in one step the largest."""
        return [self._curve(which, columns) for which in range(len(_NAMES))]

    def _curve(self, which: int, columns: int) -> Curve:
        name, unit = _NAMES[which]
        values: list[float | None] = [None] * columns
        newest = self._samples[-1] if self._samples else None
        top = 1.0
        if newest is not None:
            for taken_s, figures in self._samples:
                value = figures[which]
                if value is None:
                    continue
                top = max(top, value)
                step = columns - 1 - min(columns - 1, int((newest.taken_s - taken_s) / SPAN_S * columns))
                before = values[step]
                values[step] = value if before is None else max(before, value)
        _bridge(values)
        return Curve(name, unit, values, None if newest is None else newest.figures[which], top)


def number(value: Value) -> float | None:
    """`value` as a finite number; None for all else."""
    known = isinstance(value, float | int) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if known and value is not None else None


def _bridge(values: list[float | None]) -> None:
    """A screen may have more columns than there are samples: a step without one goes on as before, for a little."""
    longest = max(1, len(values) // 40)
    gap = longest
    for step in range(1, len(values)):
        if values[step] is not None:
            gap = 0
        elif values[step - 1] is not None and gap < longest:
            values[step] = values[step - 1]
            gap += 1
