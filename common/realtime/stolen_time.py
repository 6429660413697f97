"""Processor time that the machine took from a runnable thread, as counted by Linux."""

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_WAITED: Final = Path("/proc/thread-self/schedstat")
_PROCESSORS: Final = Path("/proc/stat")
_STOLEN: Final = 7
"""Index of `steal` among the processors' times; later ones are contained in earlier ones."""


@dataclass(frozen=True)
class StolenTime:
    """Counters since some start; None if the system gives none."""

    waited_s: float | None
    """Time in which this thread was runnable and other programs had the processor."""
    stolen: float | None
    """Time in which the host ran something else, in units of `whole`."""
    whole: float | None
    """Time of all processors together."""

    def shares_since(self, earlier: "StolenTime", passed_s: float) -> tuple[float | None, float | None]:
        """Return the waited share of `passed_s`, and the stolen share of the processors' time."""
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
