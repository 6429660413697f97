"""Resolved-rate control: joint velocities for a commanded twist, by damped least squares.

Nakamura and Hanafusa, 1986; Chiaverini, Siciliano and Egeland, 1994.
"""

import math
from typing import Final, NoReturn

import numpy as np

from common.arrays import FloatArray, require_finite
from robot_side.compiled.kernel import BOOL, building_block, compiled, inlined, input_array, output_array
from robot_side.compiled.stack import on_stack

_THRESHOLD: Final = 0.06
"""Smallest singular value below which damping begins"""
_THRESHOLD_2: Final = _THRESHOLD * _THRESHOLD
_LARGEST_DAMPING: Final = 0.06
_HALVINGS: Final = 60
"""Number of bisections by which the smallest eigenvalue is found to its last digit"""
_gram, _factor, _solution = on_stack(6, 6), on_stack(6, 6), on_stack(6)


def joint_velocities(
    jacobian: FloatArray,
    twist: FloatArray,
    velocity_limits_rad_s: FloatArray,
) -> FloatArray:
    """Find joint velocities (n,) in rad/s that give the tool `twist`; velocity_limits_rad_s (n,): their limits.

    jacobian (6, n) and twist (6,), linear rows first, are in one frame. Without damping the twist is met exactly; with
    fewer than six joints, in the least-squares sense. The damping begins where the smallest of the Jacobian's min(6, n)
    singular values is below σ_0 = 0.06: λ² = λ_max² (1 - (σ_min/σ_0)²), so that no joint runs away at a singularity. If
    a joint is over its limit, all joints are slowed by the same factor, which keeps the direction. The singular values
    mix metres and radians: σ_0 and λ_max suit an arm with a reach of about one metre.
    ValueError for a wrong shape, a limit that is not above 0, or a value that is not finite.
    """
    found: FloatArray = velocities_for(jacobian, twist[None], velocity_limits_rad_s)[0]
    return found


def velocities_for(jacobian: FloatArray, twists: FloatArray, velocity_limits_rad_s: FloatArray) -> FloatArray:
    """Return the joint velocities (m, n) for each of the twists (m, 6), as `joint_velocities` does."""
    if (jacobian.shape, twists.shape[1:]) != ((6, velocity_limits_rad_s.size), (6,)):
        raise ValueError(
            f"jacobian has the shape {jacobian.shape}, and twist {twists.shape[1:]};"
            f" valid: (6, {velocity_limits_rad_s.size}) and (6,)"
        )
    found: FloatArray = np.empty((len(twists), jacobian.shape[1]))
    given = map(np.ascontiguousarray, (jacobian, twists, velocity_limits_rad_s))
    if not _resolve(*given, found):
        _refuse(jacobian, twists, velocity_limits_rad_s)
    return found


def is_damped(jacobian: FloatArray) -> bool:
    """Return whether `joint_velocities` damps here, because the Jacobian (6, n) is near a singularity."""
    return float(np.linalg.svd(jacobian, compute_uv=False)[-1]) <= _THRESHOLD


def _refuse(jacobian: FloatArray, twists: FloatArray, velocity_limits_rad_s: FloatArray) -> NoReturn:
    """Raise a ValueError that names the argument because of which `_resolve` returned False."""
    for name, values in (("jacobian", jacobian), ("twist", twists)):
        require_finite(name, values)
    if not (velocity_limits_rad_s > 0.0).all():
        raise ValueError("velocity_limits_rad_s holds a value that is not above 0; valid: values above 0, in rad/s")
    raise ValueError("jacobian and twist are too large to be multiplied; valid: values in SI units")


@building_block
def _factorise(matrix: FloatArray, shift: float, factor: FloatArray) -> bool:
    """Fill Cholesky's lower `factor` of a symmetric matrix minus `shift` I; False if not positive definite."""
    for column in range(matrix.shape[0]):
        for row in range(column, matrix.shape[0]):
            rest = matrix[row, column] - (shift if row == column else 0.0)
            for k in range(column):
                rest -= factor[row, k] * factor[column, k]
            if row > column:
                factor[row, column] = rest / factor[column, column]
            elif rest > 0.0:
                factor[row, column] = math.sqrt(rest)
            else:
                return False
    return True


@building_block
def _factorise_damped(gram: FloatArray, factor: FloatArray) -> bool:
    """Fill Cholesky's factor of G + λ² I; False unless G is a Gram matrix of finite numbers.

    The eigenvalues of G = A Aᵀ are the squares of A's singular values. All of these are above the threshold if
    G - threshold² I has a factor. This test costs a fraction of a singular value decomposition. Otherwise σ_min² is
    the largest s for which G - s I has a factor, by bisection.
    """
    below, above = 0.0, _THRESHOLD_2
    if _factorise(gram, above, factor):
        return _factorise(gram, 0.0, factor)
    for _ in range(_HALVINGS):
        middle = 0.5 * (below + above)
        if _factorise(gram, middle, factor):
            below = middle
        else:
            above = middle
    return _factorise(gram, -_LARGEST_DAMPING * _LARGEST_DAMPING * (1.0 - below / _THRESHOLD_2), factor)


@building_block
def _solve_damped(gram: FloatArray, solution: FloatArray) -> bool:
    """Solve (G + λ² I) x = `solution` in place; False as for `_factorise_damped`."""
    size, factor = gram.shape[0], _factor()
    if not _factorise_damped(gram, factor):
        return False
    for row in range(size):
        for k in range(row):
            solution[row] -= factor[row, k] * solution[k]
        solution[row] /= factor[row, row]
    for row in range(size - 1, -1, -1):
        for k in range(row + 1, size):
            solution[row] -= factor[k, row] * solution[k]
        solution[row] /= factor[row, row]
    return True


@inlined
def _of_rows(jacobian: FloatArray, wide: bool, row: int, k: int) -> float:
    """Return an element of A, the Jacobian with its shorter side as rows: A = J, or Jᵀ with fewer than six joints."""
    return float(jacobian[row, k] if wide else jacobian[k, row])


@building_block
def _fill_gram(jacobian: FloatArray, wide: bool, gram: FloatArray) -> None:
    """Fill G = A Aᵀ (k, k), of the rows of A."""
    for row in range(gram.shape[0]):
        for column in range(gram.shape[0]):
            gram[row, column] = 0.0
            for k in range(jacobian.shape[1] if wide else 6):
                gram[row, column] += _of_rows(jacobian, wide, row, k) * _of_rows(jacobian, wide, column, k)


@building_block
def _resolve_one(jacobian: FloatArray, twist: FloatArray, limits: FloatArray, velocity: FloatArray) -> bool:
    """Fill `velocity` (n,) as `joint_velocities` does; False for values that are not finite or limits not above 0.

    Solve the normal equations of the shorter side: (J Jᵀ + λ² I) y = v and q = Jᵀ y, or with fewer than six joints (JᵀJ
    + λ² I) q = Jᵀ v. Singular values from 0.06 to 3 make a condition number of 2500, so few digits are lost.
    """
    wide = velocity.size >= 6
    size, length = (6, velocity.size) if wide else (velocity.size, 6)
    gram, solution = _gram()[:size, :size], _solution()
    _fill_gram(jacobian, wide, gram)
    for row in range(size):
        solution[row] = twist[row] if wide else 0.0
        for k in range(0 if wide else length):
            solution[row] += jacobian[k, row] * twist[k]
    if not _solve_damped(gram, solution):
        return False
    for joint in range(velocity.size):
        velocity[joint] = 0.0 if wide else solution[joint]
        for row in range(6 if wide else 0):
            velocity[joint] += jacobian[row, joint] * solution[row]
    return _limit(velocity, limits)


@building_block
def _limit(velocity: FloatArray, limits: FloatArray) -> bool:
    """Scale all joints by one factor, so that none is over its limit; False for an invalid velocity or limit."""
    excess = 1.0
    for joint in range(velocity.size):
        # An infinite limit is no limit; NaN fails the comparison.
        if not (limits[joint] > 0.0 and math.isfinite(velocity[joint])):
            return False
        excess = max(excess, abs(velocity[joint]) / limits[joint])
    for joint in range(velocity.size):
        velocity[joint] /= excess
    return True


@compiled(input_array(2), input_array(2), input_array(1), output_array(2), returns=BOOL)
def _resolve(jacobian: FloatArray, twists: FloatArray, limits: FloatArray, velocities: FloatArray) -> bool:
    found = True
    for k in range(twists.shape[0]):
        found = found and _resolve_one(jacobian, twists[k], limits, velocities[k])
    return found
