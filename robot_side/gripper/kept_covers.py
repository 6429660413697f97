"""Covers that take seconds to find, stored on disk for the next start."""

import contextlib
import hashlib
import math
import os
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from common.arrays import FloatArray
from common.clock import MonotonicClock
from common.files.user_folders import cache_folder

_BETWEEN_NOTES_S = 3.0


class SearchNotes:
    """Notes on searches for covers: what is searched and how far, at most one in a few seconds, from any thread."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """say: takes one line."""
        self._lock = threading.Lock()
        self._say, self._clock, self._next_s = say, MonotonicClock(), -math.inf

    def at(self, what: str, covered: float) -> None:
        """Say which share of the shape `what` is covered, from 0 to 1, unless the last note is too young."""
        with self._lock:
            if (now_s := self._clock.now()) >= self._next_s:
                self._next_s = now_s + _BETWEEN_NOTES_S
                self._say(
                    f"searching for spheres that cover gripper and objects: {what}, {100.0 * covered:.1f} % covered;"
                    " what is found is kept on disk"
                )


_Cover = tuple[FloatArray, FloatArray, float]
"""Centres (m, 3), radii (m,), and the distance by which the spheres protrude, in m."""


def kept_cover(shape: bytes, make: Callable[[], _Cover], folder: Path | None = None) -> _Cover:
    """Return the cover that `make` computes for a `shape`; read it from disk if the same code stored it before.

    An unreadable file is replaced. A folder without write permission stores nothing.
    """
    name = hashlib.sha256(_code() + shape).hexdigest()[:32]
    path = (cache_folder() / "covers" if folder is None else folder) / f"{name}.npy"
    with contextlib.suppress(OSError, ValueError, EOFError):
        rows = np.load(path, allow_pickle=False)
        if rows.ndim == 2 and rows.shape[1] == 5 and len(rows) and np.isfinite(rows).all():
            return rows[:, :3].copy(), rows[:, 3].copy(), float(rows[0, 4])
    centers, radii, stand_out_m = make()
    rows = np.column_stack([centers, radii, np.full(len(radii), stand_out_m)])
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        # Renamed when complete, so that another process never reads a part.
        part = path.with_name(f"{name}.{os.getpid()}.npy")
        np.save(part, rows)
        part.replace(path)
    return centers, radii, stand_out_m


@cache
def _code() -> bytes:
    """Return a digest of all code that computes covers."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files) + np.__version__.encode()).digest()
