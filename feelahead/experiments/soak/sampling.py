"""Memory and descriptors of processes, and whether they stay flat."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

SETTLED = 0.1
"""The first tenth of the run fills what is bounded: it counts as the start from then on."""
_FLAT_KB = 10 * 1024


@dataclass(frozen=True)
class Sample:
    """One process at one moment."""

    minutes: float
    resident_kb: int
    descriptors: int


def sample(process_id: int | str, minutes: float) -> Sample:
    """Look at a process ("self" is this one); ValueError when Linux does not tell."""
    folder = Path("/proc") / str(process_id)
    for line in (folder / "status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return Sample(minutes, int(line.split()[1]), sum(1 for _ in (folder / "fd").iterdir()))
    raise ValueError(f"process {process_id} tells no VmRSS; valid: a running process on Linux")


def flat(samples: Sequence[Sample], sides: int = 1) -> bool:
    """Whether memory and descriptors stay flat, from the settled start to the end.

    Flat: memory grew by less than 10 MB for each of the `sides` in the process, and descriptors not at all.
    """
    settled = samples[int(SETTLED * len(samples))]
    last = samples[-1]
    return last.resident_kb - settled.resident_kb < sides * _FLAT_KB and last.descriptors <= settled.descriptors
