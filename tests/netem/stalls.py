"""Which messages of a recording the host held up: the machine's only processor was not running.

It shows in the sending, which is planned for every millisecond. What arrives while a sending is overdue may have been
due earlier. Leaving that out favours no delay: when the host stalls has nothing to do with what netem drew.
"""

import numpy as np

from common.arrays import BoolArray
from feelahead.lab.link.samples import LinkSample

LATE_S = 0.5e-3
"""An idle machine sends within 0.2 ms."""


def stalled(sample: LinkSample, period_s: float) -> BoolArray:
    """(n,) whether a message was sent just before the machine stood still, or arrived while it did."""
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
