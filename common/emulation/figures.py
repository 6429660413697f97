"""Measured figures of an emulated link, to compare with the requested profile."""

from typing import Any, Final

from common.statistics import RunningStatistics

_COUNTED: Final = ("sent", "delivered", "lost", "outage", "held", "dropped", "duplicated", "corrupted", "retransmitted")


class LinkFigures:
    """Counts and statistics of the messages in one delay line."""

    def __init__(self, seed: int = 0) -> None:
        self.sent = 0
        """Number of messages pushed."""
        self.delivered = 0
        """Number of messages delivered, copies included."""
        self.lost = 0
        """Number of messages lost by the loss model or the trace."""
        self.outage = 0
        """Number of messages lost in an outage."""
        self.held = 0
        """Number of messages that an outage held back until its end (model `stream`)."""
        self.dropped = 0
        """Number of messages dropped because the queue was full."""
        self.duplicated = 0
        """Number of copies made of messages."""
        self.corrupted = 0
        """Number of messages in which a bit was flipped; in the model `stream` these are found corrupt and sent
        again."""
        self.retransmitted = 0
        """Number of retransmissions (model `stream`)."""
        self.late = 0
        """Number of messages that a later one overtook (RFC 4737, type-P-reordered)."""
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
        """Count the message `number`, which was pushed at `sent_s`, due at `due_s` and delivered at `now_s`."""
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
        """Return the figures, keyed by names that include the units; None without data.

        `delay_ms` and `rate_bit_s` are measured when messages are released, and so include how late the process did
        that (`release_error_us`). `loss_share` is a share of all messages sent and copied; the other shares are of
        those delivered.
        """
        span_s = self._last_delivered_s - self._first_delivered_s
        # The first message's bits came before the span, which it opens.
        bits = 8.0 * (self._delivered_bytes - self._last_bytes)
        gone = self.lost + self.dropped + self.outage
        entered = self.sent + self.duplicated
        late = self._release_error
        errors_s = {"p50": late.quantile(0.50), "p99": late.quantile(0.99), "max": late.maximum}
        return {
            **{name: count for name, count in vars(self).items() if name in _COUNTED},
            "delay_ms": self._delay.summary_ms(),
            "loss_share": gone / entered if entered else None,
            "duplicate_share": (self.delivered - self._originals) / self.delivered if self.delivered else None,
            "late_share": self.late / self._originals if self._originals else None,
            "rate_bit_s": bits / span_s if span_s > 0.0 else None,
            "release_error_us": {name: value and 1e6 * value for name, value in errors_s.items()},
        }


def report_lines(link: dict[str, Any]) -> list[str]:
    """Return a line of text for each entry of a summary's `link`: the requested profile and the achieved figures."""
    return [
        f"link {name}: asked {one['asked'] or 'no delay'}; {_achieved(one['achieved'])}" for name, one in link.items()
    ]


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
