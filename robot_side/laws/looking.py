"""Schedule of looks: in each tick the look that has waited longest is made first.

A look evaluates the law along one side from one place. Sides are R2, L2, and the stick while it is deflected. Places
are the gripper's present pose, and the poses to which it will have drifted, turned or closed its fingers. A tick has at
most one look; two once a look is 1.5 periods old; and all that are due once one is 5 periods old, or if a place is new.
A tick that measures the motion has none, unless a look is 1.5 periods old.
"""

import math
from typing import Final, NamedTuple

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.calls import call_at_address
from robot_side.compiled.kernel import BOOL, FLOAT64, building_block, inlined
from robot_side.compiled.vectors import Vector, dot, load
from robot_side.field.look import LOOK
from robot_side.field.scratch import SCRATCH, Count, Error
from robot_side.field.total_overlap import SUM_OVERLAPS
from robot_side.laws.around import FIRST_PROBE, go_to_probe, keep_probe, probe_waiting
from robot_side.laws.felt import MOST_M
from robot_side.laws.memory import Kernel, Total, memory_at
from robot_side.laws.path import go_to
from robot_side.laws.prospect import FIND_PROSPECT, stopping
from robot_side.laws.recent_looks import keep, longest_waiting
from robot_side.tick.sensed import L2, R2

OVERLAP_PERIOD_S: Final = 0.02
"""Period at which the overlap at δ is computed; this figure is for display only"""
ROUNDING_S: Final = 1e-9
_ROUNDING: Final = 1e-6
_OVERDUE: Final = 1.5
"""Age of a side's look from a place, in periods, from which a tick has two looks"""
_FAR_BEHIND: Final = 5.0
"""Age of a side's look from a place, in periods, from which a tick has all looks that are due. A place without a look
counts as infinitely old."""
_ALL: Final = 1000

scratch_at = SCRATCH.at
_find_prospect = call_at_address(BOOL, FIND_PROSPECT)
_look = call_at_address(BOOL, LOOK)
_sum_overlaps = call_at_address(FLOAT64, SUM_OVERLAPS)


class Moment(NamedTuple):
    """Input of the law's kernel in one tick: the gripper, the link and the scene."""

    rotation: FloatArray
    jacobian: FloatArray
    centers: FloatArray
    radii: FloatArray
    on_finger: BoolArray
    tool: Vector
    approach: Vector
    speed: float
    """Tool's speed along its approach axis, m/s"""
    now: float
    loop_age: float
    by_operator: bool
    """Whether the operator side predicts δ"""
    half_gap: float
    """Half the gap between the fingers, m (§3.4)"""
    right: float
    up: float
    """Deflection of the stick that moves across: `right` and `up`"""
    classes: IntArray
    closing: IntArray
    """Classes of the objects while the fingers move: the target is SKIPPED, because the fingers shall touch it."""
    velocities: FloatArray
    """Velocities of the objects (k, 3); empty if unknown, and then all objects count as at rest"""
    scene: IntArray
    scratch: IntArray


@inlined
def _fill_early(bundle: IntArray, velocities: FloatArray, stopping: float) -> None:
    """Fill the distance by which each object approaches in `stopping` seconds, until the arm stands.

    A look shortens the object's contact distances by it.
    """
    memory = memory_at(bundle)
    along = load(memory.direction.reshape(1, 3), 0)
    for thing in range(velocities.shape[0]):
        memory.approach_m[thing] = min(max(-dot(load(velocities, thing), along), 0.0) * stopping, MOST_M)


@building_block
def _look_along(bundle: IntArray, moment: Moment, side: int, place: int) -> bool:
    """Look along one side from one place or probe and keep the result. Return False for numbers that are not finite."""
    memory = memory_at(bundle)
    state, prospect, count = memory.state[0], memory.prospect[0], moment.radii.size
    there = moment.tool, moment.rotation, moment.centers, side
    probe = place - FIRST_PROBE
    if probe >= 0:
        gone = go_to_probe(bundle, *there, probe, moment.speed, moment.loop_age)
    else:
        gone = go_to(bundle, *there, place, moment.speed, moment.loop_age)
    where = memory.rotation, moment.jacobian, moment.right, moment.up, moment.loop_age, moment.by_operator
    if not _find_prospect(memory.kernels[Kernel.PROSPECT], (bundle, side, *where, gone)):
        return False
    _fill_early(bundle, moment.velocities, stopping(prospect.speed, prospect.acceleration, moment.loop_age))
    classes = moment.closing if place > 0 and state.moves_fingers == 1 else moment.classes
    gripper = memory.centers_m[:count], moment.radii, moment.on_finger, memory.tool_m, moment.jacobian
    settings = memory.settings[0]
    errors = memory.encoder_variance, memory.direction, prospect.mean, settings.camera_variance
    along = prospect.mean_along, prospect.variance_along, settings.quantile
    early = memory.approach_m[: moment.velocities.shape[0]]
    around = moment.half_gap, prospect.reach, classes, early, moment.scene, moment.scratch
    if not _look(memory.kernels[Kernel.LOOK], (*gripper, *errors, *along, *around)):
        return False
    scratch, totals = scratch_at(moment.scratch), memory.totals
    for counted in range(scratch.counts.size):
        totals[counted] += scratch.counts[counted]
    totals[Total.LOOKS] += 1
    totals[Total.WITH_NOTHING_NEAR] += 1 if scratch.counts[Count.PAIRS] == 0 else 0
    if probe >= 0:
        keep_probe(bundle, side, probe, moment.now, moment.tool, scratch.distances_m)
        return True
    leads = place == 0 and side == (R2 if moment.speed >= 0.0 else L2)
    if leads and moment.now >= state.next_overlap:
        state.next_overlap = moment.now + OVERLAP_PERIOD_S - ROUNDING_S
        for axis in range(3):
            memory.displacement_m[axis] = abs(moment.speed) * moment.loop_age * memory.direction[axis]
        spheres = scratch.spheres[:count], scratch.sigma_m[:count], memory.displacement_m
        state.overlap = _sum_overlaps(
            memory.kernels[Kernel.OVERLAPS], (*spheres, classes, moment.scene, memory.overlap_gradient, memory.nothing)
        )
    keep(bundle, side, place, moment.now, moment.tool, scratch.distances_m)
    if place == 0:
        newest = memory.newest[side]
        newest.reach, newest.speed, newest.acceleration = prospect.reach, prospect.speed, prospect.acceleration
        newest.sigma, newest.overlap = scratch.along_m[Error.LARGEST], state.overlap if leads else 0.0
    return True


@inlined
def look_at_due(bundle: IntArray, moment: Moment, at_most: int) -> bool:
    """Make up to `at_most` due looks, those that have waited longest first; more if one has waited too long.

    at_most is 0 in a tick that measures the motion. A due probe waits for a tick that neither measures the motion nor
    has another look; an overdue probe does not wait. Return False for numbers that are not finite.
    """
    busy = at_most == 0
    waited, side, place = longest_waiting(bundle, moment.now)
    if waited >= _FAR_BEHIND:
        at_most = _ALL
    elif waited >= _OVERDUE:
        at_most = 2
    while at_most > 0 and waited >= 1.0 - _ROUNDING:
        if not _look_along(bundle, moment, side, place):
            return False
        at_most, busy = at_most - 1, True
        waited, side, place = longest_waiting(bundle, moment.now)
    of_probe, side, place = probe_waiting(bundle, moment.now, moment.speed)
    due = _OVERDUE if busy else 1.0 - _ROUNDING
    while of_probe >= due:
        # After the first probe, only probes that have no look yet.
        due = math.inf
        if not _look_along(bundle, moment, side, place):
            return False
        of_probe, side, place = probe_waiting(bundle, moment.now, moment.speed)
    memory_at(bundle).state[0].next = moment.now if max(waited, of_probe) >= 1.0 - _ROUNDING else math.inf
    return True
