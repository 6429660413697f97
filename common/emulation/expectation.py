"""Delay and loss of a profile in the long run, where theory gives them, beside the measured ones."""

from typing import Any

import numpy as np

from common.arrays import FloatArray
from common.emulation.distribution import delays_at, table
from common.emulation.loss import RandomLoss
from common.emulation.profile import LinkProfile

_POINTS = 8192


def expected(profile: LinkProfile) -> dict[str, Any]:
    """`delay_ms` (mean, sd, p50, p95, p99) and `loss_share`; None for what depends on the traffic.

    Delays are known where nothing queues, is retransmitted or sent ahead; losses where they do not depend on
    outages or copies, and not for netem's correlated loss, which differs from the probability asked for.
    """
    delays_s = None if _delay_depends_on_traffic(profile) else _all_delays_s(profile)
    return {
        "delay_ms": dict.fromkeys(("mean", "sd", "p50", "p95", "p99")) if delays_s is None else _summary_ms(delays_s),
        "loss_share": _loss_share(profile),
    }


def _delay_depends_on_traffic(profile: LinkProfile) -> bool:
    return (
        profile.rate is not None
        or profile.reorder is not None
        # A stream waits for the slowest so far, unless all are alike and none is lost.
        or (
            profile.model == "stream"
            and (profile.jitter_s > 0.0 or profile.trace is not None or profile.retransmitted_share() > 0.0)
        )
        or (profile.model == "stream" and bool(profile.outages))
    )


def _all_delays_s(profile: LinkProfile) -> FloatArray:
    """Delays that are all equally likely."""
    if profile.trace is not None:
        return np.array([delay_s for delay_s in profile.trace.delays_s if delay_s is not None])
    if profile.jitter_s == 0.0:
        return np.array([profile.delay_s])
    quantiles = table(profile.distribution)
    points = _POINTS if quantiles is None else quantiles.size
    return delays_at((np.arange(points) + 0.5) / points, profile.delay_s, profile.jitter_s, profile.distribution)


def _summary_ms(delays_s: FloatArray) -> dict[str, float]:
    p50, p95, p99 = np.quantile(delays_s, [0.50, 0.95, 0.99]).tolist()
    values_s = {"mean": float(delays_s.mean()), "sd": float(delays_s.std()), "p50": p50, "p95": p95, "p99": p99}
    return {name: 1e3 * value_s for name, value_s in values_s.items()}


def _loss_share(profile: LinkProfile) -> float | None:
    if profile.model == "stream":
        return 0.0
    if profile.outages or profile.duplicate is not None:
        return None
    if profile.trace is not None:
        return profile.trace.delays_s.count(None) / len(profile.trace.delays_s)
    if profile.loss is None:
        return 0.0
    if isinstance(profile.loss, RandomLoss) and profile.loss.correlation:
        return None
    return profile.loss.share()
