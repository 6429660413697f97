"""Memory and open file descriptors of a process, as Linux reports them."""

from pathlib import Path

from common.errors import FeelaheadError


def resident_mb(process_id: int | str = "self") -> float:
    """Return the resident memory in MB; raises FeelaheadError if the system does not report it."""
    try:
        for line in Path(f"/proc/{process_id}/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024.0
    except OSError:
        pass
    raise FeelaheadError(f"process {process_id} reports no VmRSS; valid: a running process on Linux")


def descriptors(process_id: int | str = "self") -> int:
    """Return how many file descriptors the process has open."""
    return sum(1 for _ in Path(f"/proc/{process_id}/fd").iterdir())
