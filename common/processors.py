"""Number of processors that this process may use."""

import os


def usable_processors() -> int:
    """Return how many processors the system lets this process run on; all of them where it cannot say."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
