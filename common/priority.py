"""A running side goes before other work on the machine, where the system permits it."""

import contextlib
import os

_NICENESS = -10
"""Before ordinary programs, behind what the system itself needs."""


def raise_priority() -> bool:
    """Ask for a higher scheduling priority; whether it was granted, which takes root or CAP_SYS_NICE."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICENESS)
    return os.getpriority(os.PRIO_PROCESS, 0) <= _NICENESS
