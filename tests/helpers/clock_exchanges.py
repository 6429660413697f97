"""Simulated exchanges of time stamps between two clocks whose true offset is known."""

from collections.abc import Callable

import numpy as np

from common.timing.clock_offset import ClockOffset

Clock = Callable[[float], float]


def ahead(by_s: float, skew: float = 0.0) -> Clock:
    """Return a peer's clock, as a function of our time: `by_s` ahead of ours at 0, and faster by the share `skew`."""
    return lambda now_s: now_s * (1.0 + skew) + by_s


def exchange(offset: ClockOffset, start_s: float, there_s: float, held_s: float, back_s: float, clock: Clock) -> float:
    """Give `offset` one exchange with a peer that has `clock`; return when the answer arrives, by our clock."""
    peer_received_s, peer_sent_s = clock(start_s + there_s), clock(start_s + there_s + held_s)
    received_s = start_s + there_s + held_s + back_s
    offset.update(start_s, peer_sent_s, peer_sent_s - peer_received_s, received_s)
    return received_s


def talk(
    offset: ClockOffset,
    clock: Clock,
    there_s: np.ndarray,
    back_s: np.ndarray,
    start_s: float = 0.0,
    period_s: float = 0.004,
) -> float:
    """Give `offset` an exchange each `period_s`, in the answers' order of arrival; return our time at the last one."""
    sent_s = start_s + period_s * np.arange(there_s.size)
    received_s = sent_s + there_s + 0.001 + back_s
    for k in np.argsort(received_s):
        exchange(offset, float(sent_s[k]), float(there_s[k]), 0.001, float(back_s[k]), clock)
    return float(received_s.max())


def error_s(offset: ClockOffset, clock: Clock, now_s: float) -> float:
    estimate_s = offset.offset_at(now_s)
    assert estimate_s is not None
    return estimate_s - (clock(now_s) - now_s)
