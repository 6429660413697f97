"""Memory and workspace of the swept law: arrays that the law's one compiled call reads and fills."""

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
"""Maximum number of places on the gripper's path, at equal intervals of time, from which looks along a side are made"""
MOST_PLACES: Final = EVEN_PLACES + 2
"""Maximum number of places on the path: the even ones, and one to each side of the place with the shortest onset
distance, because a nearer object may lie between two even places"""
ROOM: Final = 12 * (1 + MOST_PLACES)
"""Capacity for one side's looks of the last 0.1 s: at most a hundred a second from each place"""
FINGER_POSES: Final = 8
"""Capacity for the positions of all spheres, measured in the last 0.06 s"""


class Kernel(IntEnum):
    """Kernels that are called by address. Compiled into the caller, each would add seconds to the first start."""

    ABILITY = 0
    PROSPECT = 1
    LOOK = 2
    OVERLAPS = 3


class Total(IntEnum):
    """Indices in `Memory.totals` of the counts that follow those of `Count`."""

    LOOKS = len(Count)
    WITH_NOTHING_NEAR = len(Count) + 1
    """Looks in which no sphere touched an object within the examined distance"""


STATE: Final = np.dtype(
    [
        *((name, np.int64) for name in ("spheres", "even_places", "finger_poses", "moves_fingers")),
        *(
            (name, np.float64)
            for name in ("measured", "next", "next_overlap", "overlap", "moved", "counts_since", "until")
        ),
    ]
)
"""State between ticks. spheres: number of the gripper's spheres, -1 before the first tick. even_places: number of even
places on the path. finger_poses: number of kept measurements of the spheres' positions. moves_fingers: 1 while the
fingers move. measured: when the motion was last measured. next: earliest time of the next look. next_overlap: earliest
time of the next overlap at δ. overlap: latest overlap at δ (m³). moved: when anything last moved. counts_since: time
from which looks from probes count (`around`). until: T, the duration until the arm stands. Times are in s."""
SEEN: Final = np.dtype(
    [
        ("place", np.int64),
        ("at", np.float64),
        ("direction", np.float64, (3,)),
        ("began", np.float64),
        ("onsets", np.float64, (2, STRENGTHS)),
    ]
)
"""One look. place: number of the place. at: time (s). direction: û. began: the tool's position along û at that time
(m). onsets: onset distances, fast and slow list (m)."""
AROUND: Final = np.dtype(
    [("at", np.float64), ("direction", np.float64, (3,)), ("began", np.float64), ("onsets", np.float64, (2,))]
)
"""Newest look from one probe (`around`). onsets: onset distance of full strength in the fast and the slow list (m).
at, direction, began: as in SEEN."""
NEWEST: Final = np.dtype([(name, np.float64) for name in ("reach", "speed", "acceleration", "sigma", "overlap")])
"""Newest look along one side from the gripper's present pose. reach: distance examined (m). speed, acceleration: the
arm's v_max (m/s) and a (m/s²). sigma: D_σ (m). overlap: Σ V_ij at δ (m³), 0 for the side against the motion."""
SETTINGS: Final = np.dtype(
    [
        *((name, np.float64) for name in ("trigger_speed", "stick_speed", "turn_speed", "touch_speed")),
        *((name, np.float64) for name in ("camera_variance", "quantile", "around", "astray")),
        ("mean", np.float64, (3,)),
    ]
)
"""Settings of the law. Speeds are in m/s; turn_speed is in rad/s. camera_variance: σ_c² (m²). quantile: Φ⁻¹(P). mean:
μ_ee - μ_c of eq. 10 (m). around: 0 if nobody asks for the map of onset distances, else 1. astray: `astray_m_s` of
`Situation`."""
PROSPECT: Final = np.dtype(
    [
        ("direction", np.float64, (3,)),
        *((name, np.float64) for name in ("mean", "mean_along", "variance_along", "speed", "acceleration")),
        *((name, np.float64) for name in ("reach", "gone", "stretch")),
    ]
)
"""Parameters of one look. direction: û. mean, mean_along, variance_along: û·(μ_ee - μ_c), μ_δ and σ_δ² of eq. 10.
speed, acceleration: the arm's v_max and a. reach: distance examined (m). gone: distance that the trigger moves the
gripper before it is at the look's place (m). stretch: length of the curved path divided by that of its chord."""


class MemoryColumns(NamedTuple):
    """Arrays of the memory as kernels see them; `Memory` describes each field."""

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
    """Return a contiguous float64 array. Kernels need exactly this, as a bundle holds no element types."""
    return np.ascontiguousarray(values, dtype=np.float64)


class Memory:
    """Owner of the arrays of `MemoryColumns`. Kernels take `bundle`, which holds their addresses and lengths."""

    def __init__(self, limits: JointLimits, encoder_sigma_rad: FloatArray, missed: Iterable[FloatArray]) -> None:
        """missed: two tables of prediction errors, the operator side's, then the robot side's.

        Each has rows (k, 3) of loop age, μ_δ and σ_δ.
        """
        self.state: np.ndarray = np.zeros(1, dtype=STATE)
        self.state["spheres"] = -1
        for name in ("measured", "next", "next_overlap", "moved", "counts_since"):
            self.state[name] = -np.inf
        self.seen: np.ndarray = np.zeros(SIDES * ROOM, dtype=SEEN)
        """Recent looks. Those of a side begin at index `ROOM` times the side's number."""
        self.around: np.ndarray = np.zeros(2 * PROBES, dtype=AROUND)
        """Newest look from each probe: all probes along R2, then all along L2"""
        self.around["at"] = -np.inf
        self.counts: IntArray = np.zeros(SIDES, dtype=np.int64)
        """Number of looks in `seen` for each side"""
        self.newest: np.ndarray = np.zeros(SIDES, dtype=NEWEST)
        self.looked_s: FloatArray = np.full((SIDES, 1 + MOST_PLACES), -np.inf)
        """Time of the last look along each side from each place; minus infinity before the first"""
        self.nearest_m: FloatArray = np.full((SIDES, 1 + MOST_PLACES), np.inf)
        """Onset distance of full strength (fast list) in the last look along each side from each place"""
        self.places: IntArray = np.zeros(SIDES, dtype=np.int64)
        """Number of places for each side. Place 0 is the gripper's present pose."""
        self.moments_s: FloatArray = np.zeros(EVEN_PLACES)
        """Durations until the gripper is at the even places on its path"""
        self.velocity: FloatArray = np.zeros((2, 3))
        """Linear velocity of the tool across its approach axis, and angular velocity; both are 0 while the operator
        side traces the path"""
        self.finger_poses_s: FloatArray = np.zeros(FINGER_POSES)
        self.tool_m: FloatArray = np.zeros(3)
        self.rotation: FloatArray = np.zeros((3, 3))
        """Rotation of the tool at the place from which a look is made; `tool_m` is its position there"""
        self.chord: FloatArray = np.zeros(3)
        """Displacement of the tool from the look's place for each metre that the trigger moves it"""
        self.prospect: np.ndarray = np.zeros(1, dtype=PROSPECT)
        self.direction: FloatArray = np.zeros(3)
        self.able: FloatArray = np.zeros(FOUND + limits.velocity_rad_s.size)
        """Result of `find_ability`: speed, acceleration, deviation from the wanted motion, and the joints' rates"""
        self.displacement_m: FloatArray = np.zeros(3)
        """Displacement vector δ û for the overlap that is displayed"""
        self.overlap_gradient, self.nothing = np.zeros(3), np.zeros(0)
        self.settings: np.ndarray = np.zeros(1, dtype=SETTINGS)
        able = limits.velocity_rad_s, limits.acceleration_rad_s2
        self.missed_by_operator, self.missed_by_robot, self.limits_rad_s, self.accelerations_rad_s2 = map(
            _floats, (*missed, *able)
        )
        self.encoder_variance = _floats(encoder_sigma_rad) ** 2
        self.kernels: IntArray = np.zeros(len(Kernel), dtype=np.int64)
        """Address of each kernel's machine code, indexed by `Kernel`"""
        self.totals: IntArray = np.zeros(len(Count) + len(Total), dtype=np.int64)
        self.approach_m: FloatArray = np.zeros(0)
        """Distance by which each object approaches until the arm stands; a look subtracts it"""
        self.own_m_s: FloatArray = np.zeros((0, 3))
        """Velocity of each sphere relative to the tool (m, 3), in the world frame: the fingers' motion"""
        self.finger_poses_m: FloatArray = np.zeros((0, 3))
        """Positions of all spheres in the tool frame, one measurement after another; times are in `finger_poses_s`"""
        self.centers_m: FloatArray = np.zeros((0, 3))
        """Centres of the spheres at the place from which a look is made"""

    def make_room(self, spheres: int, objects: int) -> None:
        """Allocate arrays for these numbers of spheres and objects; only arrays that are too small are replaced.

        More spheres than before drop the kept measurements of their positions.
        """
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
