"""Ways from around the gripper, part of a StiffnessUpdate: for an operator side that traces where its sticks lead."""

import math
from typing import Final

import msgspec

DIRECTIONS: Final = 4
"""Right, up, left and down of the tool"""
ACROSS: Final = 3
TURNED: Final = 2
PROBES: Final = 1 + DIRECTIONS * (ACROSS + TURNED)
"""Number of places from which a way is sent"""
_LONGEST_S: Final = 100.0
_FARTHEST_M: Final = 100.0
_WAYS: Final = ("l2_m", "l2_slow_m", "r2_m", "r2_slow_m")


class Around(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Ways of full strength from probes: places to which sticks may take the gripper until the arm stands.

    The first probe is where the gripper is. Then, for each direction, three lie across: where a fully deflected stick
    leads in a third, two thirds and all of `full_s`. Two are turned there for half and all of it.
    """

    full_s: float
    """T: until the arm stands at the latest."""
    l2_m: tuple[float, ...]
    """From each probe, none farther than the horizon; slow: as those of a TriggerField."""
    l2_slow_m: tuple[float, ...]
    r2_m: tuple[float, ...]
    r2_slow_m: tuple[float, ...]

    def __post_init__(self) -> None:
        if not (0.0 < self.full_s <= _LONGEST_S):
            raise ValueError(f"full_s = {self.full_s}; valid: above 0 to {_LONGEST_S}")
        for name in _WAYS:
            ways = getattr(self, name)
            if len(ways) != PROBES:
                raise ValueError(f"{name} has {len(ways)} ways; valid: {PROBES}")
            for way_m in ways:
                if not (0.0 <= way_m <= _FARTHEST_M and math.isfinite(way_m)):
                    raise ValueError(f"{name} = {way_m}; valid: 0 to {_FARTHEST_M}")

    def differs(self, other: "Around", by_m: float) -> bool:
        """Tell whether a way differs by more than this, or T does."""
        pairs = (zip(getattr(self, name), getattr(other, name), strict=True) for name in _WAYS)
        return self.full_s != other.full_s or any(abs(new - old) > by_m for pair in pairs for new, old in pair)
