"""What the swept law keeps from tick to tick, and the room it works in: columns that its one call reads and fills."""

from collections.abc import Iterable
from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.around import PROBES
from robot_side.arm.ability import FOUND, JointLimits
from robot_side.compiled.columns import INDICES, NUMBERS, Declared, records, rows
from robot_side.field.scratch import STRENGTHS, Count

SIDES: Final = 3
EVEN_PLACES: Final = 8
"""Places along the path, evenly in time, from which a side is looked at at most;"""
MOST_PLACES: Final = EVEN_PLACES + 2
"""and with one before and one after that of the shortest way: in between something may be nearer."""
ROOM: Final = 12 * (1 + MOST_PLACES)
"""Looks of one side: a place is looked from a hundred times a second at most."""
FINGER_POSES: Final = 8
"""The most that are kept, of the last 0.06 s."""


class Kernel(IntEnum):
    """Kernels that are called by their addresses: compiled in anew, each would cost seconds at the start."""

    ABILITY = 0
    PROSPECT = 1
    LOOK = 2
    OVERLAPS = 3


class Total(IntEnum):
    """Counts over the run, after those of `Count`."""

    LOOKS = len(Count)
    WITH_NOTHING_NEAR = len(Count) + 1
    """Looks within the reach of which no sphere met anything"""


STATE: Final = np.dtype(
    [
        *((name, np.int64) for name in ("spheres", "moments", "finger_poses", "moves_fingers")),
        *((name, np.float64) for name in ("measured", "next", "next_overlap", "overlap", "moved", "anew", "until")),
    ]
)
"""spheres: how many the gripper had, -1 before the first tick. moments: how many places besides the gripper's own are
looked from. finger_poses: how many are kept. measured, next, next_overlap: when the motion was measured, when something
is due again at the earliest, when the overlap at δ is (s). overlap: that one (m³). moved: when anything moved last.
anew: since when looks from probes count (`around`). until: T, the time until the arm stands (s)."""
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
AROUND: Final = np.dtype(
    [("at", np.float64), ("direction", np.float64, (3,)), ("began", np.float64), ("ways", np.float64, (2,))]
)
"""The newest look from a probe (`around`): when, and the ways of full strength. direction, began: as those of SEEN."""
NEWEST: Final = np.dtype([(name, np.float64) for name in ("reach", "speed", "acceleration", "sigma", "overlap")])
"""Of the newest look from where the gripper is: how far it looked, what the arm can do there, D_σ, and Σ V_ij (m³)."""
SETTINGS: Final = np.dtype(
    [
        *((name, np.float64) for name in ("trigger_speed", "stick_speed", "turn_speed", "touch_speed")),
        *((name, np.float64) for name in ("camera_variance", "quantile", "around")),
        ("mean", np.float64, (3,)),
    ]
)
"""Speeds in m/s and rad/s; σ_c² (m²), Φ⁻¹(P), and μ_ee - μ_c (m) of eq. 10. around: 0 where nobody asks for that."""
PROSPECT: Final = np.dtype(
    [
        ("direction", np.float64, (3,)),
        *((name, np.float64) for name in ("mean", "mean_along", "variance_along", "speed", "acceleration")),
        *((name, np.float64) for name in ("reach", "gone", "stretch")),
    ]
)
"""How to look along one side: û, û·(μ_ee - μ_c), μ_δ and σ_δ² of eq. 10, the arm's v_max and a; how far, the way that
is gone before, and by how much the path is longer than its chord."""


class MemoryColumns(NamedTuple):
    """The columns; the fields are those of Memory."""

    state: np.ndarray
    seen: np.ndarray
    around: np.ndarray
    counts: IntArray
    newest: np.ndarray
    looked_s: FloatArray
    nearest_m: FloatArray
    places: IntArray
    moments_s: FloatArray
    velocity: FloatArray
    own_m_s: FloatArray
    finger_poses_s: FloatArray
    finger_poses_m: FloatArray
    tool_m: FloatArray
    rotation: FloatArray
    chord: FloatArray
    centers_m: FloatArray
    early_m: FloatArray
    prospect: np.ndarray
    direction: FloatArray
    able: FloatArray
    displacement_m: FloatArray
    push: FloatArray
    nothing: FloatArray
    settings: np.ndarray
    missed_by_operator: FloatArray
    missed_by_robot: FloatArray
    limits_rad_s: FloatArray
    accelerations_rad_s2: FloatArray
    encoder_variance: FloatArray
    kernels: IntArray
    totals: IntArray


MEMORY: Final = Declared(
    MemoryColumns,
    *(records(STATE), records(SEEN), records(AROUND), INDICES, records(NEWEST), rows(1 + MOST_PLACES)),
    *(rows(1 + MOST_PLACES), INDICES, NUMBERS, rows(3), rows(3), NUMBERS, rows(3), NUMBERS, rows(3), NUMBERS, rows(3)),
    *(NUMBERS, records(PROSPECT), NUMBERS, NUMBERS, NUMBERS, NUMBERS, NUMBERS, records(SETTINGS), rows(3), rows(3)),
    *(NUMBERS, NUMBERS, NUMBERS, INDICES, INDICES),
)

memory_at = MEMORY.at


def _floats(values: FloatArray) -> FloatArray:
    """As kernels take them; a bundle knows no types."""
    return np.ascontiguousarray(values, dtype=np.float64)


class Memory:
    """What is kept; `bundle` is what kernels take."""

    def __init__(self, limits: JointLimits, encoder_sigma_rad: FloatArray, missed: Iterable[FloatArray]) -> None:
        """missed: rows (k, 3) of loop age, μ_δ, σ_δ, for the operator side's prediction and for the robot side's."""
        self.state: np.ndarray = np.zeros(1, dtype=STATE)
        self.state["spheres"] = -1
        for name in ("measured", "next", "next_overlap", "moved", "anew"):
            self.state[name] = -np.inf
        self.seen: np.ndarray = np.zeros(SIDES * ROOM, dtype=SEEN)
        """Those of one side together, from `ROOM` times the side on"""
        self.around: np.ndarray = np.zeros(2 * PROBES, dtype=AROUND)
        """Those of one side together"""
        self.around["at"] = -np.inf
        self.counts: IntArray = np.zeros(SIDES, dtype=np.int64)
        """How many there are of each side"""
        self.newest: np.ndarray = np.zeros(SIDES, dtype=NEWEST)
        self.looked_s: FloatArray = np.full((SIDES, 1 + MOST_PLACES), -np.inf)
        """By side and place: when it was last looked from there, minus infinity where it never was."""
        self.nearest_m: FloatArray = np.full((SIDES, 1 + MOST_PLACES), np.inf)
        """By side and place: the way of full strength that was found there last"""
        self.places: IntArray = np.zeros(SIDES, dtype=np.int64)
        """From how many places each side is looked at. Place 0 is where the gripper is."""
        self.moments_s: FloatArray = np.zeros(EVEN_PLACES)
        """After which the gripper will be at the even places"""
        self.velocity: FloatArray = np.zeros((2, 3))
        """Linear and angular, of the tool, without that along its approach axis"""
        self.finger_poses_s: FloatArray = np.zeros(FINGER_POSES)
        self.tool_m: FloatArray = np.zeros(3)
        self.rotation: FloatArray = np.zeros((3, 3))
        """Of the tool at the place that is looked from"""
        self.chord: FloatArray = np.zeros(3)
        """Where the trigger leads on to from there, by 1 m of its way"""
        self.prospect: np.ndarray = np.zeros(1, dtype=PROSPECT)
        self.direction: FloatArray = np.zeros(3)
        self.able: FloatArray = np.zeros(FOUND + limits.velocity_rad_s.size)
        """Speed and acceleration there, by how much the motion is off, and the joints' rates"""
        self.displacement_m: FloatArray = np.zeros(3)
        """δ of the overlap that is looked at"""
        self.push, self.nothing = np.zeros(3), np.zeros(0)
        self.settings: np.ndarray = np.zeros(1, dtype=SETTINGS)
        able = limits.velocity_rad_s, limits.acceleration_rad_s2
        self.missed_by_operator, self.missed_by_robot, self.limits_rad_s, self.accelerations_rad_s2 = map(
            _floats, (*missed, *able)
        )
        self.encoder_variance = _floats(encoder_sigma_rad) ** 2
        self.kernels: IntArray = np.zeros(len(Kernel), dtype=np.int64)
        """Their addresses"""
        self.totals: IntArray = np.zeros(len(Count) + len(Total), dtype=np.int64)
        self.early_m: FloatArray = np.zeros(0)
        """By how much each object's ways are shorter, as it comes nearer"""
        self.own_m_s: FloatArray = np.zeros((0, 3))
        """(m, 3) of each sphere against the tool: the fingers', in the world frame"""
        self.finger_poses_m: FloatArray = np.zeros((0, 3))
        """Where the spheres were in the tool frame, pose after pose"""
        self.centers_m: FloatArray = np.zeros((0, 3))
        """Of the spheres at the place that is looked from"""

    def make_room(self, spheres: int, objects: int) -> None:
        """Have room for a gripper of m spheres among k objects; what is known of the same spheres stays."""
        if objects > len(self.early_m):
            self.early_m = np.zeros(objects)
        if spheres > len(self.own_m_s):
            self.own_m_s, self.centers_m = np.zeros((spheres, 3)), np.zeros((spheres, 3))
            self.finger_poses_m = np.zeros((FINGER_POSES * spheres, 3))
            self.state["spheres"], self.state["finger_poses"] = -1, 0
        self.bundle = MEMORY.bundle(self)

    def fits(self, spheres: int, objects: int) -> bool:
        """Whether there is room for these numbers of spheres and objects."""
        return spheres <= len(self.own_m_s) and objects <= len(self.early_m)
