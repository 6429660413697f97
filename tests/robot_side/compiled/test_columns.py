"""Bundles of arrays: what a kernel reads from them, and which arrays are refused."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pytest

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.columns import BUNDLED, FLAGS, INDICES, NUMBERS, Declared, matrices, records, rows

RECORD = np.dtype([("place", np.int64), ("way", np.float64)])


class Inner(NamedTuple):
    numbers: FloatArray


class Columns(NamedTuple):
    numbers: FloatArray
    indices: IntArray
    flags: BoolArray
    points: FloatArray
    turns: FloatArray
    found: np.ndarray
    inner: IntArray


INNER = Declared(Inner, NUMBERS)
DECLARED = Declared(Columns, NUMBERS, INDICES, FLAGS, rows(3), matrices(2, 3), records(RECORD), BUNDLED)
_at, _inner_at = DECLARED.at, INNER.at


@dataclass
class Owner:
    numbers: FloatArray = field(default_factory=lambda: np.array([1.5, 2.5]))
    indices: IntArray = field(default_factory=lambda: np.array([7, 8, 9]))
    flags: BoolArray = field(default_factory=lambda: np.array([False, True]))
    points: FloatArray = field(default_factory=lambda: np.arange(12.0).reshape(4, 3))
    turns: FloatArray = field(default_factory=lambda: np.arange(18.0).reshape(3, 2, 3))
    found: np.ndarray = field(default_factory=lambda: np.zeros(2, dtype=RECORD))

    def __post_init__(self) -> None:
        self.inner = INNER.bundle(self)


def test_another_number_of_views_than_of_columns_is_refused() -> None:
    with pytest.raises(TypeError, match="Columns has 7 columns; 1 forms are given"):
        Declared(Columns, NUMBERS)


@pytest.mark.parametrize(
    ("owner", "said"),
    [
        (Owner(points=np.zeros((4, 6))[:, ::2]), r"points: float64 \(4, 3\) .*C-contiguous, aligned float64 \(n, 3\)"),
        (Owner(indices=np.zeros(3, dtype=np.int32)), "cannot be bundled; valid: C-contiguous"),
        (Owner(points=np.zeros((4, 2))), "cannot be bundled"),
        (Owner(points=np.zeros(97, dtype=np.uint8)[1:].view(np.float64).reshape(4, 3)), "cannot be bundled"),
        (Owner(turns=np.zeros((3, 2, 3), dtype=np.float32)), "cannot be bundled"),
    ],
)
def test_an_array_of_another_form_than_declared_is_refused(owner: Owner, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        DECLARED.bundle(owner)
