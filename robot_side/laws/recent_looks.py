"""What was seen of what is ahead lately, along each side and from each place; the shortest ways hold."""

from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.arm.ability import Ability
from robot_side.compiled.kernel import COUNT, NUMBER, compiled, input_array, output_indices, record_array
from robot_side.compiled.vectors import dot, load
from robot_side.field.scratch import STRENGTHS
from robot_side.laws.sideways import MOST_PLACES

R2, L2, STICK = 0, 1, 2
SIDES: Final = 3
STEADY_S: Final = 0.1
"""For so long a way that was found holds; as long as strength takes to fall in the trigger."""
_SAME_DIRECTION: Final = 0.999
"""Cosine: 2.6° to either side."""
ROOM: Final = 12 * (1 + MOST_PLACES)
"""Looks of one side: a place is looked from a hundred times a second at most."""

SEEN: Final = np.dtype(
    [
        ("place", np.int64),
        ("at", np.float64),
        ("direction", np.float64, (3,)),
        ("began", np.float64),
        ("ways", np.float64, (2, STRENGTHS)),
    ]
)
"""One look: when, from which place, the ways that it found, fast and slow. began: where the tool was along it (m)."""
NEWEST: Final = np.dtype([(name, np.float64) for name in ("reach", "speed", "acceleration", "sigma", "overlap")])
"""Of the newest look from where the gripper is: how far it looked, what the arm can do there, D_σ, and Σ V_ij (m³)."""


class Looks:
    """Tables of what was seen along the sides R2, L2 and STICK. Place 0 is where the gripper is."""

    def __init__(self) -> None:
        self.seen: np.ndarray = np.zeros(SIDES * ROOM, dtype=SEEN)
        """Those of one side together, from `ROOM` times the side on"""
        self.counts: IntArray = np.zeros(SIDES, dtype=np.int64)
        """How many there are of each side"""
        self.newest: np.ndarray = np.zeros(SIDES, dtype=NEWEST)
        self.looked_s: tuple[list[float], ...] = tuple([] for _ in range(SIDES))
        """By side and place: when it was last looked from there, minus infinity where it never was."""

    def look_from(self, side: int, places: int) -> None:
        """Look along one side from so many places from now on; what was seen from others is forgotten."""
        looked_s = self.looked_s[side]
        if places < len(looked_s):
            del looked_s[places:]
            first, count = ROOM * side, int(self.counts[side])
            kept = self.seen[first : first + count]
            kept = kept[kept["place"] < places]
            self.seen[first : first + len(kept)] = kept
            self.counts[side] = len(kept)
        looked_s += [-np.inf] * (places - len(looked_s))

    def due(self, now_s: float, period_s: float) -> list[tuple[float, int, int]]:
        """How many periods each side has waited at each place, with these two, the longest first.

        A place that the gripper is yet to come to has twice the period.
        """
        return sorted(
            [
                ((now_s - looked_s) / (2.0 * period_s if place > 0 else period_s), side, place)
                for side, all_looked_s in enumerate(self.looked_s)
                for place, looked_s in enumerate(all_looked_s)
            ],
            key=lambda one: (-one[0], one[1], one[2]),
        )

    def add(
        self,
        side: int,
        place: int,
        now_s: float,
        direction: FloatArray,
        tool_m: FloatArray,
        ways_m: FloatArray,
        able: Ability,
        reach_m: float,
        sigma_m: float,
        overlap_m3: float,
    ) -> None:
        """Take a look in; direction (3,), tool_m (3,): where the tool was; ways_m (2, 8), fast and slow.

        What was seen from the same place is forgotten if it is too old or was along another direction.
        """
        self.looked_s[side][place] = now_s
        _keep(self.seen, self.counts, side, place, now_s, direction, tool_m, ways_m)
        if place == 0:
            self.newest[side] = reach_m, able.full_speed_m_s, able.acceleration_m_s2, sigma_m, overlap_m3


@compiled(
    *(record_array(SEEN), output_indices(), COUNT, COUNT, NUMBER, input_array(1), input_array(1), input_array(2)),
)
def _keep(
    seen: np.ndarray,
    counts: IntArray,
    side: int,
    place: int,
    now: float,
    direction: FloatArray,
    tool: FloatArray,
    ways: FloatArray,
) -> None:
    along, first, kept = load(direction.reshape(1, 3), 0), ROOM * side, 0
    oldest = first
    for k in range(first, first + counts[side]):
        one = seen[k]
        holds = now - one.at < STEADY_S and dot((one.direction[0], one.direction[1], one.direction[2]), along) > (
            _SAME_DIRECTION
        )
        if one.place != place or holds:
            seen[first + kept] = one
            if one.at < seen[oldest].at:
                oldest = first + kept
            kept += 1
    row = first + kept
    if kept == ROOM:
        row = oldest
    else:
        kept += 1
    counts[side] = kept
    new = seen[row]
    new.place, new.at, new.began = place, now, dot(along, load(tool.reshape(1, 3), 0))
    for axis in range(3):
        new.direction[axis] = direction[axis]
    for kind in range(2):
        for strength in range(STRENGTHS):
            new.ways[kind, strength] = ways[kind, strength]
