"""Parameters of a look along one side: direction, the arm's speed and acceleration in it, and errors (eq. 9-10)."""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from common.reaction import HORIZON_S
from robot_side.arm.ability import ABILITY
from robot_side.compiled.calls import call_at_address
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import BOOL, FLOAT64, INT64, compiled, inlined, input_array
from robot_side.compiled.vectors import load, norm
from robot_side.enlargement.prediction_errors import prediction_error
from robot_side.laws.memory import Kernel, memory_at
from robot_side.tick.sensed import R2, STICK

BEYOND_M: Final = 0.05
"""Distance examined beyond the stopping distance (loop age, reaction and braking), because the loop age varies"""
FIELD_PERIOD_S: Final = 0.01
"""Period of looks from the gripper's present pose, as controllers are written to no more often. Looks from places ahead
on the path have three times this period."""

_find_ability = call_at_address(BOOL, ABILITY)
_prediction_error = inlined(prediction_error)


def stopping_s(speed: float, acceleration: float, loop_age: float) -> float:
    """Return the time in s from a report until the arm stands: full speed for loop age and reaction, then braking."""
    return loop_age + HORIZON_S + speed / acceleration


stopping = inlined(stopping_s)
"""The function `stopping_s` for calls from kernels"""


@inlined
def horizon_m(speed: float, acceleration: float, loop_age: float) -> float:
    """Return the distance to examine: the stopping distance from full speed, reaction included, plus BEYOND_M."""
    return speed * (loop_age + HORIZON_S) + speed * speed / (2.0 * acceleration) + BEYOND_M


FIND_PROSPECT: Final = (BUNDLE, INT64, input_array(2), input_array(2), FLOAT64, FLOAT64, FLOAT64, BOOL, FLOAT64)
"""Argument types of `find_prospect`, for calls by address"""


@compiled(*FIND_PROSPECT, returns=BOOL)
def find_prospect(
    bundle: IntArray,
    side: int,
    rotation: FloatArray,
    jacobian: FloatArray,
    right: float,
    up: float,
    loop_age: float,
    by_operator: bool,
    gone: float,
) -> bool:
    """Fill the memory's `prospect` and `direction` for a look along one side.

    Return False if the Jacobian or direction is not finite, or a joint's limit is not above 0. bundle: the memory's.
    rotation (3, 3): the tool's at the look's place. jacobian (6, n): the tool's present one. right, up: the stick's
    deflection. by_operator: whether the operator side predicts δ. gone: distance (m) that the trigger has moved the
    gripper when it is at the look's place.
    """
    memory = memory_at(bundle)
    settings, found, able = memory.settings[0], memory.prospect[0], memory.able
    length = norm(load(memory.chord.reshape(1, 3), 0))
    for axis in range(3):
        ahead = memory.chord[axis] / length
        memory.direction[axis] = ahead if side == R2 else -ahead
        if side == STICK:
            memory.direction[axis] = (right * rotation[axis, 0] - up * rotation[axis, 1]) / math.hypot(right, up)
        found.direction[axis] = memory.direction[axis]
    full_speed = settings.stick_speed if side == STICK else settings.trigger_speed
    given = jacobian, memory.direction, full_speed, memory.limits_rad_s, memory.accelerations_rad_s2, able
    if not _find_ability(memory.kernels[Kernel.ABILITY], given):
        return False
    found.speed, found.acceleration = able[0], able[1]
    mean, sd = 0.0, 0.0
    # The stick's rumble takes the commanded speed: no prediction, so no prediction error.
    if side != STICK:
        rows = memory.missed_by_operator if by_operator else memory.missed_by_robot
        mean, sd = _prediction_error(rows, loop_age, found.speed)
    # Until it stands, an arm that does not follow goes on as it now does.
    mean += settings.astray * (loop_age + found.speed / found.acceleration)
    found.mean, found.mean_along, found.variance_along = 0.0, mean, sd * sd
    for axis in range(3):
        found.mean += found.direction[axis] * settings.mean[axis]
    farthest = horizon_m(found.speed, found.acceleration, loop_age) + 2.0 * FIELD_PERIOD_S * full_speed
    found.gone, found.stretch, found.reach = gone, 1.0 / length, max(farthest - gone, 0.0) * length
    return True
