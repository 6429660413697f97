"""Messages of a recording that the host delayed, while the machine's only processor was not running.

Stalls show in the sending, planned for every millisecond. Messages that arrive while a sending is overdue may have been
due earlier. Leaving them out favours no delay: the host's stalls are independent of netem's draws.
"""

import numpy as np

from common.arrays import BoolArray
from feelahead.lab.link.samples import LinkSample

LATE_S = 0.5e-3
"""Lateness in seconds from which a sending is overdue: an idle machine sends within 0.2 ms."""


def stalled(sample: LinkSample, period_s: float) -> BoolArray:
    """Return whether (n,) each message was sent just before the machine stalled, or arrived while it did."""
    numbers = np.arange(sample.sent_s.size)
    planned_s = numbers * period_s + float(np.min(sample.sent_s - numbers * period_s))
    overdue = sample.sent_s - planned_s > LATE_S
    just_before = np.append(overdue[1:], False)
    if not overdue.any():
        return just_before
    starts_s, ends_s = planned_s[overdue], np.maximum.accumulate(sample.sent_s[overdue] + LATE_S)
    arrived_s = sample.sent_s + sample.delay_s
    last = np.searchsorted(starts_s, arrived_s, side="right") - 1
    return just_before | ((last >= 0) & (arrived_s <= ends_s[last]))
