"""Find messages of a recording that were delayed because the host did not run the virtual machine's only processor.

Messages are to be sent each millisecond, so a stall shows as a late sending. A message that arrives meanwhile may have
been due earlier. Leaving such messages out does not bias the delays: stalls are independent of netem's random draws.
"""

import numpy as np

from common.arrays import BoolArray
from feelahead.lab.link.samples import LinkSample

LATE_S = 0.5e-3
"""Seconds by which a sending must be late to count as a stall: an idle machine is late by at most 0.2 ms"""


def stalled(sample: LinkSample, period_s: float) -> BoolArray:
    """Return, for each message (n,), whether it was sent just before the machine stalled, or arrived during a stall."""
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
