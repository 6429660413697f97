"""Rate that one direction of a link carries without a queue, found from the delays of our messages.

This is delay-based congestion control as in GCC (Carlucci et al. 2017). In a queue the rate falls to 0.85 of the
delivered rate. Near the last known capacity it grows by 5 % a second. The target of the queueing delay is that of
SCReAM (RFC 8298), much shortened; it rises with the jitter, estimated as in RFC 3550. Late echoes are detected as by
the timeout of RFC 6298.
"""

import math
from collections import deque
from enum import IntEnum
from typing import Final

from common.rate.outgoing_queue import Echo

LEAST_BIT_S: Final = 100e3
MOST_BIT_S: Final = 1e9
START_BIT_S: Final = 1e6
TARGET_S: Final = 0.010
"""Standing queueing delay of our messages, in seconds, above which the link counts as overused."""
_JITTER_S: Final = 0.003
"""Jitter assumed until it is measured, in seconds."""
_CALM_S: Final = 0.001
_SLACK: Final = 5.0
"""Multiple of the jitter above _CALM_S by which the target rises, because the least of several delays varies as
much."""
_AFTER: Final = 2
"""Number of echoes after a burst that still show the burst's queue, and so do not measure jitter."""
_MOST_APART_S: Final = 0.03
"""Limit to which a difference of successive delays counts as jitter, in seconds: a lost packet causes larger ones."""
_WINDOW_S: Final = 0.09
"""Window in seconds of which the least queueing delay counts: jitter and a lost packet delay single messages, a
standing queue delays all."""
_FEWEST: Final = 5
_DELIVERY_S: Final = 0.15
"""Span of arrivals over which the delivered rate is measured, in seconds."""
_DECREASE: Final = 0.85
_LARGEST_DECREASE: Final = 0.5
"""Least factor by which one echo reduces the rate: after a pause of the process little was sent, and so little
delivered.
"""
_DOUBLING_S: Final = 0.5
_FAR_DOUBLING_S: Final = 1.5
_NEAR_GROWTH: Final = 1.05
_NEAR: Final = (0.8, 1.1)
"""Range of rates that count as near the last known capacity, as shares of that capacity."""
_LIMITED_S: Final = 0.25
_BURST_S: Final = 0.003
"""Least transmission time, in seconds, with which paced messages count as a burst."""
_BURSTS_S: Final = 0.005
"""Mean queueing delay right after bursts, in seconds, at which the bursts' rate counts as the link's, and grows no
more.
"""
_EASING: Final = 0.5
"""Factor per second by which the rate falls if bursts cause more than 1.5 times the queueing delay _BURSTS_S."""
_SILENT_S: Final = 1.0
_MOST_UNDER_WAY: Final = 8192


class Urgency(IntEnum):
    """Urgency of a message, which decides whether it waits or is dropped."""

    MUST = 0
    """The message never waits: haptics, stops, leases."""
    SOON = 1
    """Telemetry: dropped if the rate does not allow it, because a newer one follows."""
    PACED = 2
    """The message waits until the rate allows it: pictures, the scene."""


class RateController:
    """Controller of the allowed rate and of pauses in sending, from sent messages and their echoes.

    A queue that does not shrink while we send only urgent messages is caused by other traffic. Its delay is subtracted
    from the measured one, until it shrinks.
    """

    def __init__(self) -> None:
        self.rate_bit_s = START_BIT_S
        """Allowed rate of all streams together, headers included."""
        self._limited_s = -math.inf
        self._updated_s = -math.inf
        self.begin_epoch()

    def begin_epoch(self) -> None:
        """Forget all that was measured of the link, but keep the rate; called when echoes stop."""
        self._capacity_bit_s: float | None = None
        """Delivered rate when the last queue was found; None before the first queue."""
        self._under_way: deque[tuple[float, int, Urgency]] = deque(maxlen=_MOST_UNDER_WAY)
        self._arrived_bytes = 0
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=_MOST_UNDER_WAY)
        self._recent: deque[tuple[float, float]] = deque()
        self._behind_s = 0.0
        """Mean queueing delay of messages right after a burst, in seconds."""
        self.queue_s = 0.0
        """Newest measured queueing delay, in seconds."""
        self._jitter_s = _JITTER_S
        self._calm = 0
        self._calm_queue_s = 0.0
        self._loaded_s = -math.inf
        self._others_s = 0.0
        self._draining: tuple[float, float] | None = None
        self._newest_sent_s: float | None = None
        self._heard_s = -math.inf
        self._answer_s = self._answer_deviation_s = 0.0

    def sent(self, size_bytes: int, now_s: float, urgency: Urgency) -> None:
        """Note a sent message; `size_bytes` includes the headers."""
        self._under_way.append((now_s, size_bytes, urgency))

    def heard(self, echo: Echo, now_s: float) -> None:
        """Process the echo of one of our messages; call it in ascending order of `echo.sent_s`."""
        before, paced_bytes = Urgency.MUST, 0
        while self._under_way and self._under_way[0][0] <= echo.sent_s:
            _, size_bytes, urgency = self._under_way.popleft()
            self._arrived_bytes += size_bytes
            before = max(before, urgency)
            paced_bytes += size_bytes if urgency is Urgency.PACED else 0
        self._arrivals.append((echo.arrived_s, self._arrived_bytes))
        while echo.arrived_s - self._arrivals[0][0] > _DELIVERY_S and len(self._arrivals) > _FEWEST:
            self._arrivals.popleft()
        self._follow_answers(echo, now_s)
        self._follow_jitter(echo.queue_s, before)
        if 8.0 * paced_bytes > _BURST_S * self.rate_bit_s:
            self._behind_s += (echo.queue_s - self._behind_s) / 8.0
            self._loaded_s = now_s
        self.queue_s = echo.queue_s
        self._recent.append((now_s, echo.queue_s))
        while now_s - self._recent[0][0] > _WINDOW_S and len(self._recent) > _FEWEST:
            self._recent.popleft()
        if len(self._recent) >= _FEWEST:
            self._judge(echo, min(queue_s for _, queue_s in self._recent), now_s)

    def _follow_jitter(self, queue_s: float, before: Urgency) -> None:
        """Update the jitter, unless a burst of ours caused the delay. before: least urgent class just echoed."""
        if before is Urgency.PACED or self._draining is not None:
            self._calm = 0
        elif before is Urgency.MUST:
            self._calm += 1
            if self._calm > _AFTER:
                apart_s = min(abs(queue_s - self._calm_queue_s), _MOST_APART_S)
                self._jitter_s += (apart_s - self._jitter_s) / 16.0
            self._calm_queue_s = queue_s

    def _follow_answers(self, echo: Echo, now_s: float) -> None:
        waited_s = now_s - (echo.sent_s if self._newest_sent_s is None else self._newest_sent_s)
        if self._newest_sent_s is None:
            self._answer_s, self._answer_deviation_s = waited_s, 0.5 * waited_s
        self._answer_deviation_s += 0.25 * (abs(waited_s - self._answer_s) - self._answer_deviation_s)
        self._answer_s += 0.125 * (waited_s - self._answer_s)
        self._newest_sent_s, self._heard_s = echo.sent_s, now_s

    @property
    def _slack_s(self) -> float:
        return _SLACK * max(0.0, self._jitter_s - _CALM_S)

    @property
    def _limit_s(self) -> float:
        return TARGET_S + self._slack_s

    def _judge(self, echo: Echo, least_s: float, now_s: float) -> None:
        self._others_s = min(self._others_s, least_s)
        if self._draining is not None:
            self._behind_s = self._others_s
        own_s = least_s - self._others_s
        if self._draining is None:
            if own_s > self._limit_s:
                self._draining = now_s, least_s
                self._decrease()
            elif own_s < 0.5 * self._limit_s and (through_bit_s := self.delivered_bit_s) is not None:
                # Haptics may exceed the allowed rate; a delivered rate without a queue is within the capacity.
                self.rate_bit_s = min(max(self.rate_bit_s, _DECREASE * through_bit_s), MOST_BIT_S)
            return
        began_s, most_s = self._draining
        if echo.sent_s <= began_s:
            self._draining = began_s, max(most_s, least_s)
            self._decrease()
        elif own_s < 0.5 * self._limit_s:
            self._draining = None
        elif echo.sent_s > began_s + 2.0 * most_s + _WINDOW_S:
            self._others_s, self._draining = least_s, None

    def _decrease(self) -> None:
        through_bit_s = self.delivered_bit_s
        if through_bit_s is None:
            return
        self._capacity_bit_s = through_bit_s
        least_bit_s = max(LEAST_BIT_S, _LARGEST_DECREASE * self.rate_bit_s)
        self.rate_bit_s = max(least_bit_s, min(self.rate_bit_s, _DECREASE * through_bit_s))

    @property
    def delivered_bit_s(self) -> float | None:
        """Rate at which the last echoed messages arrived, in bit/s; None while too few echoes are known."""
        if len(self._arrivals) < _FEWEST:
            return None
        (first_s, first_bytes), (last_s, last_bytes) = self._arrivals[0], self._arrivals[-1]
        return 8.0 * (last_bytes - first_bytes) / (last_s - first_s) if last_s > first_s else None

    def may_send(self, now_s: float) -> bool:
        """Return whether messages that can wait may leave: no queue of ours drains or begins, echoes are on time."""
        if self._draining is not None or self.queue_s - self._others_s > 2.0 * self._limit_s:
            return False
        if self._newest_sent_s is None:
            return True
        late_s = now_s - self._newest_sent_s - self._answer_s
        return late_s <= max(2.0 * self._answer_deviation_s, TARGET_S)

    @property
    def begins(self) -> bool:
        """Whether the link has shown no limit yet."""
        return self._capacity_bit_s is None

    @property
    def drains(self) -> bool:
        """Whether a queue of ours is draining."""
        return self._draining is not None

    def update(self, now_s: float, *, limited: bool) -> None:
        """Let the rate grow while it limits what we send. Call it in every turn.

        limited: messages wait because of the rate. Otherwise too little is sent to test a higher rate.
        """
        elapsed_s = min(max(0.0, now_s - self._updated_s), 0.1)
        self._updated_s = now_s
        if limited:
            self._limited_s = now_s
        if self._newest_sent_s is not None and now_s - self._heard_s > _SILENT_S:
            self.begin_epoch()
            self.rate_bit_s = min(self.rate_bit_s, 0.25 * START_BIT_S)
        heard = now_s - self._heard_s < _LIMITED_S
        if heard and now_s - self._limited_s < _LIMITED_S and self.may_send(now_s):
            rate_bit_s = self.rate_bit_s * self._growth(elapsed_s)
            self.rate_bit_s = min(max(LEAST_BIT_S, rate_bit_s), MOST_BIT_S)

    def _growth(self, elapsed_s: float) -> float:
        share = (self._behind_s - self._others_s) / (_BURSTS_S + self._slack_s)
        if share > 1.0 and self._updated_s - self._loaded_s < _SILENT_S:
            return float(_EASING**elapsed_s) if share > 1.5 else 1.0
        if self._capacity_bit_s is None:
            return float(2.0 ** (elapsed_s / _DOUBLING_S))
        low, high = _NEAR
        if low * self._capacity_bit_s <= self.rate_bit_s <= high * self._capacity_bit_s:
            return float(_NEAR_GROWTH**elapsed_s)
        return float(2.0 ** (elapsed_s / _FAR_DOUBLING_S))
