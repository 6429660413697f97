"""Cells of the mapped region, and the blocks of cells in which surfaces are looked for."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector
from robot_side.depth.settings import MapSettings

LEVELS: Final = 4
"""Halvings from a block of 16 cells a side to a single cell"""

_ASIDE: Final = 0.37


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells in a box of the world."""

    place: FloatArray
    """(5,) lower corner and edge of a cell, in m, and cells in a metre"""
    cells: IntArray
    """(3,) number of cells along each axis"""

    @staticmethod
    def of(settings: MapSettings) -> "Grid":
        """Return the cells of the settings' region."""
        # Tables and walls often stand at round numbers: there no blocks should meet, as noise would divide a plane.
        lower_m = np.array(settings.lower_m) - _ASIDE * settings.cell_m
        return Grid(np.array([*lower_m, settings.cell_m, 1.0 / settings.cell_m]), np.array(settings.cells) + 1)

    @property
    def blocks(self) -> IntArray:
        """Number of blocks along each axis (3,)"""
        return ((self.cells - 1) >> LEVELS) + 1


@inlined
def cell_at(place: FloatArray, cells: IntArray, a: Vector) -> int:
    """Return the number of the cell that holds a point; -1 outside the region."""
    i = math.floor((a[0] - place[0]) * place[4])
    j = math.floor((a[1] - place[1]) * place[4])
    k = math.floor((a[2] - place[2]) * place[4])
    if i < 0 or j < 0 or k < 0 or i >= cells[0] or j >= cells[1] or k >= cells[2]:
        return -1
    cell: int = (i * cells[1] + j) * cells[2] + k
    return cell


@inlined
def indices_of(cells: IntArray, cell: int) -> tuple[int, int, int]:
    """Return a cell's indices along the axes."""
    return cell // (cells[1] * cells[2]), cell // cells[2] % cells[1], cell % cells[2]


@inlined
def block_of(cells: IntArray, cell: int) -> int:
    """Return the number of the block that holds a cell."""
    i, j, k = indices_of(cells, cell)
    across, up = ((cells[1] - 1) >> LEVELS) + 1, ((cells[2] - 1) >> LEVELS) + 1
    block: int = ((i >> LEVELS) * across + (j >> LEVELS)) * up + (k >> LEVELS)
    return block
