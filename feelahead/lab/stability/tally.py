"""Tally of the cases of one class: worst error, undefined results, exceptions and most steps."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from feelahead.lab.table import Row


@dataclass
class Tally:
    """Cases of one class, each noted with its errors."""

    case: str
    """Name of the class, as the table shows it"""
    measure: str
    """Unit of the errors, and what they are relative to"""
    limit: float
    """Largest error that is no failure"""
    most_steps: int | None = None
    """Largest number of steps that is no failure; None for a part that does not iterate"""
    of: str = ""
    """Finer class, in the files alone"""
    cases: int = 0
    error: float = 0.0
    undefined: int = 0
    """Number of cases with NaN or infinity"""
    exceptions: int = 0
    steps: int | None = None
    where: str = field(default="", repr=False)
    """Case of the worst error, or of the last exception"""

    def note(self, errors: npt.ArrayLike, where: str = "", steps: int | None = None) -> None:
        """Count one case, with its errors (any shape, magnitudes count) and steps. where: the case in words."""
        self.cases += 1
        given = np.abs(np.asarray(errors, dtype=np.float64))
        if not np.isfinite(given).all():
            self.undefined += 1
            self.where = f"{where}: not finite"
        elif (worst := float(given.max(initial=0.0))) > self.error:
            self.error, self.where = worst, self.where if self.undefined else where
        if steps is not None:
            self.steps = max(self.steps or 0, steps)

    @contextmanager
    def tried(self, where: str = "") -> Iterator[None]:
        """Count an exception within, which ends this case alone, as a failure."""
        try:
            yield
        except Exception as error:
            self.cases += 1
            self.exceptions += 1
            self.where = f"{where}: {type(error).__name__}: {error}"

    def row(self) -> Row:
        """Return the tally as a row of the table."""
        return {
            "case": self.case,
            "of": self.of,
            "measure": self.measure,
            "cases": self.cases,
            "error": self.error,
            "limit": self.limit,
            "undefined": self.undefined,
            "exceptions": self.exceptions,
            "steps": self.steps,
            "most_steps": self.most_steps,
            "where": self.where,
            "failed": self.failed,
        }

    @property
    def failed(self) -> bool:
        """Whether an error or the steps are above their limits, or a case gave no number, or none was tried."""
        too_long = self.most_steps is not None and (self.steps or 0) > self.most_steps
        return self.error > self.limit or too_long or self.undefined + self.exceptions > 0 or not self.cases


@dataclass(frozen=True)
class Part:
    """One part under stress."""

    groups: tuple[str, ...]
    """Groups of classes, each a cell of the question"""
    counts: tuple[int, int]
    """Number of cases of a class, and the number with --quick"""
    check: Callable[[str, int, np.random.Generator], Iterator[Tally]]
    """Function (group, number of cases of a class, random generator) that tries a group's classes"""
