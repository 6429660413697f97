"""Time in which a thread could have run but other programs or the host had the processor, as Linux counts it."""

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_WAITED: Final = Path("/proc/thread-self/schedstat")
_PROCESSORS: Final = Path("/proc/stat")
_STOLEN: Final = 7
"""Index of `steal` among the processors' times in /proc/stat; the times after it are included in earlier ones."""


@dataclass(frozen=True)
class StolenTime:
    """Counters of processor time since an arbitrary start; None if the system does not have them."""

    waited_s: float | None
    """Time in seconds in which the calling thread could have run, but other programs had the processor."""
    stolen: float | None
    """Time in which the host of this virtual machine ran something else, in the unit of `whole`."""
    whole: float | None
    """Total time of all processors, in the kernel's unit."""

    def shares_since(self, earlier: "StolenTime", passed_s: float) -> tuple[float | None, float | None]:
        """Return the share of `passed_s` that the thread waited, and the stolen share of all processors' time."""
        whole = None if self.whole is None or earlier.whole is None else self.whole - earlier.whole
        return _share(self.waited_s, earlier.waited_s, passed_s), _share(self.stolen, earlier.stolen, whole)


def _share(now: float | None, earlier: float | None, whole: float | None) -> float | None:
    return (now - earlier) / whole if now is not None and earlier is not None and whole else None


def read_stolen_time() -> StolenTime:
    """Read the counters of the calling thread."""
    waited_s = stolen = whole = None
    with contextlib.suppress(OSError, ValueError, IndexError):
        waited_s = 1e-9 * int(_WAITED.read_text(encoding="ascii").split()[1])
    with contextlib.suppress(OSError, ValueError, IndexError), _PROCESSORS.open(encoding="ascii") as file:
        times = [float(text) for text in file.readline().split()[1 : _STOLEN + 2]]
        stolen, whole = times[_STOLEN], sum(times)
    return StolenTime(waited_s, stolen, whole)
