"""Statistics of a stream of samples, in bounded memory."""

import math
from array import array
from bisect import bisect_left, insort
from collections import deque
from collections.abc import Sequence

import numpy as np

RESERVOIR_SIZE = 50_000
"""Number of samples kept for quantiles, so that 200 s of turns of 4 ms are exact; of more, a uniform random choice is
kept."""
BLOCK = 512
"""Number of samples that are processed together."""


class RunningStatistics:
    """Mean, standard deviation, extremes and quantiles of all samples added; None without samples.

    Quantiles are exact up to `RESERVOIR_SIZE` samples; beyond that they are from a uniform random choice of so many
    samples. The other figures are always exact. Samples are processed in blocks, or when a figure is read, so that
    adding one in a tick takes little time.
    """

    def __init__(self, seed: int = 0) -> None:
        self._generator = np.random.default_rng(seed)
        self._waiting: list[float] = []
        self._count = 0
        self._mean = 0.0
        self._squares = 0.0
        self._minimum = math.inf
        self._maximum = -math.inf
        self._reservoir = array("d")
        self._log_threshold = 0.0
        self._next_kept = RESERVOIR_SIZE

    def add(self, value: float) -> None:
        """Add one sample; raises ValueError if it is not finite."""
        if not math.isfinite(value):
            raise ValueError(f"value = {value}; valid: a finite number")
        self._waiting.append(value)
        if len(self._waiting) == BLOCK:
            self._take_in()

    def extend(self, values: Sequence[float]) -> None:
        """Add many samples; raises ValueError, and adds none, if one is not finite."""
        if not all(map(math.isfinite, values)):
            raise ValueError("values holds NaN or infinity; valid: finite numbers")
        self._waiting.extend(values)
        if len(self._waiting) >= BLOCK:
            self._take_in()

    def _take_in(self) -> None:
        """Process the waiting samples; moments are combined after Chan, Golub and LeVeque 1979."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        before, added = self._count, len(waiting)
        mean = _mean(waiting)
        apart, share = mean - self._mean, added / (before + added)
        spread = math.dist(waiting, [mean] * added)
        self._squares += spread * spread + apart * apart * before * share
        self._mean += apart * share
        self._count += added
        self._minimum = min(self._minimum, *waiting)
        self._maximum = max(self._maximum, *waiting)
        self._reservoir.extend(waiting[: max(0, RESERVOIR_SIZE - before)])
        while self._next_kept <= self._count:
            if self._next_kept > RESERVOIR_SIZE:
                place = int(self._generator.integers(RESERVOIR_SIZE))
                self._reservoir[place] = waiting[self._next_kept - before - 1]
            self._choose_next_kept()

    def _choose_next_kept(self) -> None:
        """Choose the next sample that enters the reservoir (Li 1994, algorithm L).

        The algorithm draws random numbers for each kept sample, not for each added one.
        """
        first, second = 1.0 - self._generator.random(2)
        self._log_threshold += math.log(first) / RESERVOIR_SIZE
        self._next_kept += math.floor(math.log(second) / math.log1p(-math.exp(self._log_threshold))) + 1

    @property
    def count(self) -> int:
        """Number of samples added."""
        return self._count + len(self._waiting)

    @property
    def mean(self) -> float | None:
        """Arithmetic mean."""
        self._take_in()
        return self._mean if self._count else None

    @property
    def sd(self) -> float | None:
        """Standard deviation, with the divisor n − 1; None for fewer than two samples."""
        self._take_in()
        return math.sqrt(self._squares / (self._count - 1)) if self._count > 1 else None

    @property
    def minimum(self) -> float | None:
        """Least sample."""
        self._take_in()
        return self._minimum if self._count else None

    @property
    def maximum(self) -> float | None:
        """Greatest sample."""
        self._take_in()
        return self._maximum if self._count else None

    def quantile(self, probability: float) -> float | None:
        """Return the `probability` quantile, interpolated linearly; raises ValueError outside [0, 1]."""
        if not 0.0 <= probability <= 1.0:
            raise ValueError(f"probability = {probability}; valid: 0 to 1")
        self._take_in()
        return float(np.quantile(np.array(self._reservoir), probability)) if self._count else None

    def summary_ms(self) -> dict[str, float | None]:
        """Return `mean`, `sd`, `p50`, `p95` and `p99` in milliseconds, if the samples are in seconds."""
        values_s = {
            "mean": self.mean,
            "sd": self.sd,
            "p50": self.quantile(0.50),
            "p95": self.quantile(0.95),
            "p99": self.quantile(0.99),
        }
        return {name: None if value is None else 1e3 * value for name, value in values_s.items()}


def _mean(values: list[float]) -> float:
    try:
        return math.fsum(values) / len(values)
    except OverflowError:  # stamps that a peer invented
        return math.fsum(value / len(values) for value in values)


class SlidingQuantile:
    """Quantile of the samples of the last `window_s` seconds, updated with each.

    It is the quantile by nearest rank: the least sample that at least the fraction `probability` of the samples does
    not exceed. So of a few samples it is the maximum.
    """

    def __init__(self, window_s: float = 0.5, probability: float = 0.95) -> None:
        if not window_s > 0.0:
            raise ValueError(f"window_s = {window_s}; valid: above 0 seconds")
        if not 0.0 < probability <= 1.0:
            raise ValueError(f"probability = {probability}; valid: above 0, up to 1")
        self._window_s = window_s
        self._probability = probability
        self._arrivals: deque[tuple[float, float]] = deque()
        self._sorted: list[float] = []
        self.value: float | None = None
        """Present quantile; None while there are no samples."""

    def update(self, value: float, now_s: float) -> float:
        """Add the newest sample, forget those before the window, and return the quantile.

        Raises ValueError if the value is not finite.
        """
        if not math.isfinite(value):
            raise ValueError(f"value = {value}; valid: a finite number")
        arrivals, ordered = self._arrivals, self._sorted
        while arrivals and arrivals[0][0] <= now_s - self._window_s:
            del ordered[bisect_left(ordered, arrivals.popleft()[1])]
        arrivals.append((now_s, value))
        insort(ordered, value)
        self.value = newest = ordered[math.ceil(self._probability * len(ordered)) - 1]
        return newest

    def clear(self) -> None:
        """Forget all samples."""
        self._arrivals.clear()
        self._sorted.clear()
        self.value = None


class SlidingMinimum:
    """Least value at the newest `span` positions, kept in a monotonic queue of at most `span` values.

    A value is forgotten as soon as a later value is not above it.
    """

    def __init__(self, span: int) -> None:
        self._span = span
        self._candidates: deque[tuple[int, float]] = deque()

    def update(self, position: int, value: float) -> float:
        """Add `value` at `position`, an integer that never decreases; return the minimum."""
        candidates = self._candidates
        while candidates and candidates[-1][1] >= value:
            candidates.pop()
        if not candidates or candidates[-1][0] != position:
            candidates.append((position, value))
        while candidates[0][0] <= position - self._span:
            candidates.popleft()
        return candidates[0][1]

    def __len__(self) -> int:
        return len(self._candidates)

    @property
    def value(self) -> float | None:
        """Present minimum; None before the first value."""
        return self._candidates[0][1] if self._candidates else None


def microseconds(time_s: RunningStatistics) -> dict[str, float | None]:
    """Return `p50`, `p99` and `max` in microseconds, of samples in seconds."""
    values_s = {"p50": time_s.quantile(0.50), "p99": time_s.quantile(0.99), "max": time_s.maximum}
    return {name: None if value is None else 1e6 * value for name, value in values_s.items()}
