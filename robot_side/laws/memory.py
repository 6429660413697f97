"""Memory and workspace of the swept law: columns that its one compiled call reads and fills."""

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
"""Most places on the path, evenly in time, from which a side is looked along"""
MOST_PLACES: Final = EVEN_PLACES + 2
"""Most places, with one before and one after that of the shortest onset distance: a nearer object may lie between."""
ROOM: Final = 12 * (1 + MOST_PLACES)
"""Capacity for one side's looks: at most a hundred a second from each place"""
FINGER_POSES: Final = 8
"""Capacity for the fingers' poses of the last 0.06 s"""


class Kernel(IntEnum):
    """Kernels that are called by address: compiled into the caller, each would cost seconds at the start."""

    ABILITY = 0
    PROSPECT = 1
    LOOK = 2
    OVERLAPS = 3


class Total(IntEnum):
    """Indices of the run's counts, after those of `Count`."""

    LOOKS = len(Count)
    WITH_NOTHING_NEAR = len(Count) + 1
    """Looks in whose reach no sphere met an object"""


STATE: Final = np.dtype(
    [
        *((name, np.int64) for name in ("spheres", "even_places", "finger_poses", "moves_fingers")),
        *(
            (name, np.float64)
            for name in ("measured", "next", "next_overlap", "overlap", "moved", "counts_since", "until")
        ),
    ]
)
"""spheres: number of the gripper's spheres, -1 before the first tick. even_places: number of even places on the path.
finger_poses: number kept. measured: time of the last motion measurement (s). next: earliest time of the next look (s).
next_overlap, overlap: time of the next overlap at δ (s), and the latest one (m³). moved: time of the last motion (s).
counts_since: time from which looks from probes count (s, `around`). until: T, the time until the arm stands (s)."""
SEEN: Final = np.dtype(
    [
        ("place", np.int64),
        ("at", np.float64),
        ("direction", np.float64, (3,)),
        ("began", np.float64),
        ("onsets", np.float64, (2, STRENGTHS)),
    ]
)
"""One look: its place, time and onset distances, fast and slow. began: the tool's position along its direction (m)."""
AROUND: Final = np.dtype(
    [("at", np.float64), ("direction", np.float64, (3,)), ("began", np.float64), ("onsets", np.float64, (2,))]
)
"""Newest look from a probe (`around`): time and onset distances of full strength. direction, began: as in SEEN."""
NEWEST: Final = np.dtype([(name, np.float64) for name in ("reach", "speed", "acceleration", "sigma", "overlap")])
"""Newest look from the gripper's place: reach (m), the arm's speed and acceleration there, D_σ (m), Σ V_ij (m³)."""
SETTINGS: Final = np.dtype(
    [
        *((name, np.float64) for name in ("trigger_speed", "stick_speed", "turn_speed", "touch_speed")),
        *((name, np.float64) for name in ("camera_variance", "quantile", "around")),
        ("mean", np.float64, (3,)),
    ]
)
"""Speeds in m/s and rad/s; σ_c² (m²), Φ⁻¹(P), and μ_ee - μ_c (m) of eq. 10. around: 0 if nobody asks for the map."""
PROSPECT: Final = np.dtype(
    [
        ("direction", np.float64, (3,)),
        *((name, np.float64) for name in ("mean", "mean_along", "variance_along", "speed", "acceleration")),
        *((name, np.float64) for name in ("reach", "gone", "stretch")),
    ]
)
"""Parameters of a look: û, û·(μ_ee - μ_c), μ_δ and σ_δ² of eq. 10, the arm's v_max and a. `reach` is the distance
examined (m), `gone` that covered before the place (m), `stretch` the length of the path over that of its chord."""


class MemoryColumns(NamedTuple):
    """Columns of the bundle; the fields are those of Memory."""

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
    approach_m: FloatArray
    prospect: np.ndarray
    direction: FloatArray
    able: FloatArray
    displacement_m: FloatArray
    overlap_gradient: FloatArray
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
    """Return a contiguous float64 array, as kernels need it: a bundle carries no types."""
    return np.ascontiguousarray(values, dtype=np.float64)


class Memory:
    """Owner of the columns; `bundle` is the argument for kernels."""

    def __init__(self, limits: JointLimits, encoder_sigma_rad: FloatArray, missed: Iterable[FloatArray]) -> None:
        """missed: rows (k, 3) of loop age, μ_δ, σ_δ, first of the operator side's prediction, then the robot side's."""
        self.state: np.ndarray = np.zeros(1, dtype=STATE)
        self.state["spheres"] = -1
        for name in ("measured", "next", "next_overlap", "moved", "counts_since"):
            self.state[name] = -np.inf
        self.seen: np.ndarray = np.zeros(SIDES * ROOM, dtype=SEEN)
        """Looks by side: a side's begin at `ROOM` times its number"""
        self.around: np.ndarray = np.zeros(2 * PROBES, dtype=AROUND)
        """Looks from probes, grouped by side"""
        self.around["at"] = -np.inf
        self.counts: IntArray = np.zeros(SIDES, dtype=np.int64)
        """Number of looks by side"""
        self.newest: np.ndarray = np.zeros(SIDES, dtype=NEWEST)
        self.looked_s: FloatArray = np.full((SIDES, 1 + MOST_PLACES), -np.inf)
        """Time of the last look by side and place, minus infinity before the first"""
        self.nearest_m: FloatArray = np.full((SIDES, 1 + MOST_PLACES), np.inf)
        """Onset distance of full strength in the last look, by side and place"""
        self.places: IntArray = np.zeros(SIDES, dtype=np.int64)
        """Number of places by side. Place 0 is where the gripper is."""
        self.moments_s: FloatArray = np.zeros(EVEN_PLACES)
        """Times until the gripper reaches the even places"""
        self.velocity: FloatArray = np.zeros((2, 3))
        """Linear velocity of the tool across its approach axis, and angular velocity"""
        self.finger_poses_s: FloatArray = np.zeros(FINGER_POSES)
        self.tool_m: FloatArray = np.zeros(3)
        self.rotation: FloatArray = np.zeros((3, 3))
        """Rotation of the tool at the place of the look"""
        self.chord: FloatArray = np.zeros(3)
        """Displacement of the tool from there, for 1 m of the trigger's path"""
        self.prospect: np.ndarray = np.zeros(1, dtype=PROSPECT)
        self.direction: FloatArray = np.zeros(3)
        self.able: FloatArray = np.zeros(FOUND + limits.velocity_rad_s.size)
        """Result of `find_ability`: speed, acceleration, error of the motion, and the joints' rates"""
        self.displacement_m: FloatArray = np.zeros(3)
        """δ of the overlap figure"""
        self.overlap_gradient, self.nothing = np.zeros(3), np.zeros(0)
        self.settings: np.ndarray = np.zeros(1, dtype=SETTINGS)
        able = limits.velocity_rad_s, limits.acceleration_rad_s2
        self.missed_by_operator, self.missed_by_robot, self.limits_rad_s, self.accelerations_rad_s2 = map(
            _floats, (*missed, *able)
        )
        self.encoder_variance = _floats(encoder_sigma_rad) ** 2
        self.kernels: IntArray = np.zeros(len(Kernel), dtype=np.int64)
        """Addresses by `Kernel`"""
        self.totals: IntArray = np.zeros(len(Count) + len(Total), dtype=np.int64)
        self.approach_m: FloatArray = np.zeros(0)
        """Approach of each object, by which its contact distances shorten"""
        self.own_m_s: FloatArray = np.zeros((0, 3))
        """Velocity of each sphere against the tool (m, 3), in the world frame: the fingers' motion"""
        self.finger_poses_m: FloatArray = np.zeros((0, 3))
        """Positions of the spheres in the tool frame, pose after pose"""
        self.centers_m: FloatArray = np.zeros((0, 3))
        """Centres of the spheres at the place of the look"""

    def make_room(self, spheres: int, objects: int) -> None:
        """Allocate columns for this number of spheres and objects. State of the same spheres stays."""
        if objects > len(self.approach_m):
            self.approach_m = np.zeros(objects)
        if spheres > len(self.own_m_s):
            self.own_m_s, self.centers_m = np.zeros((spheres, 3)), np.zeros((spheres, 3))
            self.finger_poses_m = np.zeros((FINGER_POSES * spheres, 3))
            self.state["spheres"], self.state["finger_poses"] = -1, 0
        self.bundle = MEMORY.bundle(self)

    def fits(self, spheres: int, objects: int) -> bool:
        """Return whether there is room for these numbers of spheres and objects."""
        return spheres <= len(self.own_m_s) and objects <= len(self.approach_m)
