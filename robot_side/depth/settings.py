"""Settings of the map of surfaces."""

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import tyro
from msgspec import Meta

from common.limits import Limited

_Corner = tuple[Annotated[float, Meta(ge=-20.0, le=20.0)], ...]
_MOST_CELLS: Final = 50_000_000


@dataclass(frozen=True)
class MapSettings(Limited):
    """Where surfaces are mapped, how finely, and how many of them are handed on."""

    lower_m: _Corner = (-1.0, -1.0, -0.2)
    """Lower corner of the mapped region, in the world frame"""
    upper_m: _Corner = (1.0, 1.0, 1.0)
    """Upper corner of the mapped region"""
    cell_m: Annotated[float, Meta(ge=0.004, le=0.05)] = 0.01
    """Edge of a cell; each cell holds one surfel."""
    padding_m: Annotated[float, Meta(ge=0.0, le=0.1)] = 0.01
    """Distance from the robot's own solids within which a measured point is the robot's own"""
    slots: Annotated[int, Meta(ge=64, le=16384)] = 2048
    """Largest number of surfaces that are handed on"""
    unseen: Annotated[Literal["free", "half"], tyro.conf.arg(metavar="{free,half}")] = "free"
    """Space that no camera has seen: free, or felt with at most half strength. half needs --law swept."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, corner in (("lower_m", self.lower_m), ("upper_m", self.upper_m)):
            if len(corner) != 3:
                raise ValueError(f"{name} = {corner!r}; valid: three coordinates")
        if any(high - low < self.cell_m for low, high in zip(self.lower_m, self.upper_m, strict=True)):
            raise ValueError(f"upper_m = {self.upper_m!r}; valid: above lower_m = {self.lower_m!r} by a cell or more")
        if math.prod(self.cells) > _MOST_CELLS:
            raise ValueError(f"cell_m = {self.cell_m!r} makes {math.prod(self.cells)} cells; valid: {_MOST_CELLS}")

    @property
    def cells(self) -> tuple[int, int, int]:
        """Number of cells along each axis"""
        x, y, z = (
            math.ceil((high - low) / self.cell_m - 1e-9) for low, high in zip(self.lower_m, self.upper_m, strict=True)
        )
        return x, y, z
