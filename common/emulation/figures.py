"""The figures of an emulated link: measured ones, and those that theory gives, to stand beside the ones asked for."""

from typing import Any

import numpy as np

from common.arrays import FloatArray
from common.emulation.distribution import delays_at, table
from common.emulation.loss import RandomLoss
from common.emulation.profile import LinkProfile
from common.statistics import RunningStatistics

_POINTS = 8192


class LinkFigures:
    """Counts and statistics of one line, message by message."""

    def __init__(self, seed: int = 0) -> None:
        self.sent = 0
        """Messages taken in."""
        self.delivered = 0
        """Messages given out, copies included."""
        self.lost = 0
        """By the loss model, or by the trace."""
        self.outage = 0
        """Lost because of an outage."""
        self.held = 0
        """In a stream, held back by an outage until its end."""
        self.dropped = 0
        """Because too many were waiting."""
        self.duplicated = 0
        """Copies made."""
        self.corrupted = 0
        """Messages with a bit turned over; in a stream, found corrupt and sent again."""
        self.retransmitted = 0
        """In a stream, sendings on top of the first."""
        self.late = 0
        """Messages overtaken by a later one (RFC 4737, type-P-reordered)."""
        self._delay = RunningStatistics(seed)
        self._release_error = RunningStatistics(seed)
        self._delivered_bytes = 0
        self._last_bytes = 0
        self._newest = -1
        self._originals = 0
        self._first_delivered_s = 0.0
        self._last_delivered_s = 0.0

    def add_delivered(
        self, now_s: float, sent_s: float, due_s: float, number: int, size_bytes: int, *, copy: bool
    ) -> None:
        """A message that entered as number `number` at `sent_s` leaves at `now_s`, having been due at `due_s`."""
        self._delay.add(now_s - sent_s)
        self._release_error.add(now_s - due_s)
        if not self.delivered:
            self._first_delivered_s = now_s
        self.delivered += 1
        self._delivered_bytes += size_bytes
        self._last_bytes = size_bytes
        self._last_delivered_s = now_s
        if copy:
            return
        self._originals += 1
        if number < self._newest:
            self.late += 1
        else:
            self._newest = number

    def achieved(self) -> dict[str, Any]:
        """The figures by name, in the units of their names; None where there is nothing to tell yet.

        `delay_ms` and the rate are of what was delivered, as the receiver's end of the link saw it, and so
        include how late the process released it: `release_error_us`. `loss_share` is of all that was sent and
        copied, the other shares are of what was delivered.
        """
        span_s = self._last_delivered_s - self._first_delivered_s
        # The first message opens the span, and its bits came before it.
        bits = 8.0 * (self._delivered_bytes - self._last_bytes)
        gone = self.lost + self.dropped + self.outage
        entered = self.sent + self.duplicated
        errors_us = {
            name: None if value is None else 1e6 * value
            for name, value in (
                ("p50", self._release_error.quantile(0.50)),
                ("p99", self._release_error.quantile(0.99)),
                ("max", self._release_error.maximum),
            )
        }
        return {
            "sent": self.sent,
            "delivered": self.delivered,
            "lost": self.lost,
            "outage": self.outage,
            "held": self.held,
            "dropped": self.dropped,
            "duplicated": self.duplicated,
            "corrupted": self.corrupted,
            "retransmitted": self.retransmitted,
            "delay_ms": self._delay.summary_ms(),
            "loss_share": gone / entered if entered else None,
            "duplicate_share": (self.delivered - self._originals) / self.delivered if self.delivered else None,
            "late_share": self.late / self._originals if self._originals else None,
            "rate_bit_s": bits / span_s if span_s > 0.0 else None,
            "release_error_us": errors_us,
        }


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


def report_lines(link: dict[str, Any]) -> list[str]:
    """A line of text for each line of a summary's `link`: what was asked, and what was achieved."""
    return [f"link {name}: asked {_asked(one)}; {_achieved(one['achieved'])}" for name, one in link.items()]


def _asked(one: dict[str, Any]) -> str:
    delay_ms, loss_share = one["expected"]["delay_ms"], one["expected"]["loss_share"]
    known = []
    if delay_ms["mean"] is not None:
        known.append(f"{delay_ms['mean']:.2f} ± {delay_ms['sd']:.2f} ms, p99 {delay_ms['p99']:.1f} ms")
    if loss_share:
        known.append(f"{100.0 * loss_share:.2f} % lost")
    return (one["asked"] or "no delay") + (f" ({', '.join(known)})" if known else "")


def _achieved(achieved: dict[str, Any]) -> str:
    delay_ms = achieved["delay_ms"]
    if delay_ms["mean"] is None:
        return f"nothing of {achieved['sent']} delivered"
    said = [f"achieved {delay_ms['mean']:.2f} ± {delay_ms['sd'] or 0.0:.2f} ms", f"p99 {delay_ms['p99']:.1f} ms"]
    said += [
        f"{100.0 * achieved[f'{name}_share']:.2f} % {word}"
        for name, word in (("loss", "lost"), ("duplicate", "doubled"), ("late", "reordered"))
        if achieved[f"{name}_share"]
    ]
    return ", ".join([*said, f"of {achieved['sent']}"])
