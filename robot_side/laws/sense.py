"""The swept law's one compiled call per tick: it computes the stiffness of both triggers from a situation.

measure the motion ─▶ due looks ─▶ prospect ─▶ look ─▶ keep ─▶ feel
"""

import math

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.calls import call_at_address
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import (
    BOOL,
    FLOAT64,
    building_block,
    compiled,
    inlined,
    input_array,
    input_flags,
    input_indices,
    output_array,
)
from robot_side.compiled.vectors import Vector, add, dot, load, scale, subtract
from robot_side.laws.around import follow_motion, is_known
from robot_side.laws.felt import feel
from robot_side.laws.fingers import measure_fingers
from robot_side.laws.looking import ROUNDING_S, Moment, look_at_due
from robot_side.laws.memory import Kernel, memory_at
from robot_side.laws.path import plan_places
from robot_side.laws.prospect import FIELD_PERIOD_S, FIND_PROSPECT, stopping
from robot_side.laws.recent_looks import longest_ago, look_from
from robot_side.tick.sensed import ENLARGEMENT, L2, OVERLAP, R2, STICK

_find_prospect = call_at_address(BOOL, FIND_PROSPECT)


@inlined
def _velocity(jacobian: FloatArray, first: int, rates: FloatArray) -> Vector:
    """Return the product of three rows of the Jacobian, from `first` on, with the joint rates (n,)."""
    found = 0.0, 0.0, 0.0
    for joint in range(rates.size):
        column = jacobian[first, joint], jacobian[first + 1, joint], jacobian[first + 2, joint]
        found = add(found, scale(rates[joint], column))
    return found


@building_block
def _measure(bundle: IntArray, moment: Moment, velocity: Vector, turning: Vector, changed: bool) -> bool:
    """Measure the gripper's motion besides the triggers' and plan the places on its path.

    Return False if the Jacobian is not finite or a joint's limit is not above 0.
    """
    memory = memory_at(bundle)
    state, across = memory.state[0], subtract(velocity, scale(moment.speed, moment.approach))
    # The operator side traces the sticks' motion through the map.
    traced = is_known(bundle) and moment.by_operator
    for axis in range(3):
        memory.velocity[0, axis] = 0.0 if traced else across[axis]
        memory.velocity[1, axis] = 0.0 if traced else turning[axis]
        memory.chord[axis] = moment.approach[axis]
    measure_fingers(bundle, moment.centers, moment.tool, moment.rotation, moment.now, changed)
    state.spheres = moment.radii.size
    where = moment.rotation, moment.jacobian, 0.0, 0.0, moment.loop_age, moment.by_operator
    if not _find_prospect(memory.kernels[Kernel.PROSPECT], (bundle, R2, *where, 0.0)):
        return False
    able = memory.prospect[0]
    until = stopping(able.speed, able.acceleration, moment.loop_age)
    follow_motion(bundle, velocity, turning, changed, until, moment.now, moment.by_operator)
    plan_places(bundle, moment.centers, moment.tool, moment.approach, until, until * able.speed)
    state.measured = moment.now
    return True


@compiled(
    *(input_array(1), input_array(2), input_array(2), input_array(2), input_array(1), input_flags(), input_array(1)),
    *(FLOAT64, FLOAT64, BOOL, BOOL, FLOAT64, FLOAT64, FLOAT64, input_indices(), input_indices(), input_array(2)),
    *(BUNDLE, BUNDLE, BUNDLE, output_array(1)),
    returns=BOOL,
)
def sense(
    tool_position: FloatArray,
    rotation: FloatArray,
    jacobian: FloatArray,
    centers: FloatArray,
    radii: FloatArray,
    on_finger: BoolArray,
    rates: FloatArray,
    now: float,
    loop_age: float,
    is_known: bool,
    by_operator: bool,
    half_gap: float,
    right: float,
    up: float,
    classes: IntArray,
    closing: IntArray,
    velocities: FloatArray,
    scene_bundle: IntArray,
    scratch_bundle: IntArray,
    bundle: IntArray,
    felt: FloatArray,
) -> bool:
    """Fill `felt`, made by `felt_array`, with the tick's result. Return False for wrong sizes or non-finite numbers.

    NaN would compare as far away, and so give no warning. tool_position (3,), rotation (3, 3), jacobian (6, n),
    rates (n,): the joints'. centers (m, 3), radii (m,), on_finger (m,): the spheres'. is_known: whether the loop age
    is known. bundle: the memory's. All other arguments are those of `Moment`.
    """
    memory = memory_at(bundle)
    joints, spheres = rates.size, radii.size
    if not (jacobian.shape[1] == memory.limits_rad_s.size == memory.encoder_variance.size == joints):
        return False
    if not (centers.shape[0] == on_finger.size == spheres):
        return False
    state, tool = memory.state[0], load(tool_position.reshape(1, 3), 0)
    approach, velocity = (rotation[0, 2], rotation[1, 2], rotation[2, 2]), _velocity(jacobian, 0, rates)
    # A look checks the spheres and the rest of the pose itself.
    if not math.isfinite(dot(tool, approach) + dot(velocity, velocity) + now + loop_age + right + up):
        return False
    deflected, changed = right != 0.0 or up != 0.0, state.spheres != radii.size
    if now >= state.next or changed or deflected != (memory.places[STICK] > 0):
        moment = Moment(
            *(rotation, jacobian, centers, radii, on_finger, tool, approach, dot(velocity, approach), now, loop_age),
            *(by_operator, half_gap, right, up, classes, closing, velocities, scene_bundle, scratch_bundle),
        )
        at_most = 1
        # Gripping and releasing change the number of spheres.
        if changed or now - state.measured >= FIELD_PERIOD_S - ROUNDING_S:
            if not _measure(bundle, moment, velocity, _velocity(jacobian, 3, rates), changed):
                return False
            at_most = 0
        for side in (R2, L2):
            look_from(bundle, side, 1 + state.even_places + (2 if state.even_places > 0 else 0))
        look_from(bundle, STICK, 1 if deflected else 0)
        if not look_at_due(bundle, moment, at_most):
            return False
        state.next = min(state.next, min(state.measured, longest_ago(bundle)) + FIELD_PERIOD_S - ROUNDING_S)
    feel(bundle, tool, approach, velocity, loop_age, is_known, math.hypot(right, up), felt)
    return math.isfinite(felt[ENLARGEMENT] + felt[OVERLAP])
