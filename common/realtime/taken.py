"""What the machine took away from a thread that had something to do: Linux counts it."""

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_WAITED: Final = Path("/proc/thread-self/schedstat")
_PROCESSORS: Final = Path("/proc/stat")
_STOLEN: Final = 7
"""The place of `steal` among the processors' times; those behind it are counted in others, too."""


@dataclass(frozen=True)
class Taken:
    """Counts since some start; None where the system does not tell."""

    waited_s: float | None
    """This thread could have run, and other programs had the processor."""
    stolen: float | None
    """The processors could have run, and their host ran something else; in units of `whole`."""
    whole: float | None
    """All processors' time together."""

    def shares_since(self, earlier: "Taken", passed_s: float) -> tuple[float | None, float | None]:
        """Of the `passed_s` between: the share that this thread waited, and the share that was stolen."""
        whole = None if self.whole is None or earlier.whole is None else self.whole - earlier.whole
        return _share(self.waited_s, earlier.waited_s, passed_s), _share(self.stolen, earlier.stolen, whole)


def _share(now: float | None, earlier: float | None, whole: float | None) -> float | None:
    return (now - earlier) / whole if now is not None and earlier is not None and whole else None


def read_taken() -> Taken:
    """What is counted now, for the thread that asks."""
    waited_s = stolen = whole = None
    with contextlib.suppress(OSError, ValueError, IndexError):
        waited_s = 1e-9 * int(_WAITED.read_text(encoding="ascii").split()[1])
    with contextlib.suppress(OSError, ValueError, IndexError), _PROCESSORS.open(encoding="ascii") as file:
        times = [float(text) for text in file.readline().split()[1 : _STOLEN + 2]]
        stolen, whole = times[_STOLEN], sum(times)
    return Taken(waited_s, stolen, whole)
