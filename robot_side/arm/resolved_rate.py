"""Resolved-rate control: the joint velocity that moves the tool as asked, by damped least squares.

Nakamura and Hanafusa, 1986; Chiaverini, Siciliano and Egeland, 1994.
"""

import math

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import NUMBER, TRUTH, building_block, compiled, input_array, output_array


def joint_velocities(
    jacobian: FloatArray,
    twist: FloatArray,
    velocity_limits_rad_s: FloatArray,
    singular_value_threshold: float = 0.06,
    largest_damping: float = 0.06,
) -> FloatArray:
    """Joint velocities (n,) in rad/s that give the tool `twist`, at most `velocity_limits_rad_s` (n,) each.

    jacobian (6, n) and twist (6,), linear rows first, are in one frame. While the smallest of the Jacobian's
    min(6, n) singular values stays above the threshold there is no damping and the twist is met exactly, or in
    the least-squares sense by an arm with fewer than six joints. Below it λ² = λ_max² (1 - (σ_min/σ_0)²), so that
    no joint runs away at a singularity. A joint over its limit slows all of them alike, which keeps the direction.
    Metres and radians are mixed in the singular values: the defaults suit an arm of about one metre's reach.
    ValueError for a wrong shape, a limit that is not above 0, or a value that is not finite.
    """
    if jacobian.ndim != 2 or jacobian.shape[0] != 6 or jacobian.shape[1] == 0:
        raise ValueError(f"jacobian has the shape {jacobian.shape}; valid: (6, n) with n of 1 or more")
    if twist.shape != (6,):
        raise ValueError(f"twist has the shape {twist.shape}; valid: (6,)")
    if velocity_limits_rad_s.shape != jacobian.shape[1:]:
        raise ValueError(
            f"velocity_limits_rad_s has the shape {velocity_limits_rad_s.shape}; valid: {jacobian.shape[1:]}"
        )
    for name, value in (
        ("singular_value_threshold", singular_value_threshold),
        ("largest_damping", largest_damping),
    ):
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} = {value}; valid: finite and above 0")

    velocity = _undamped(jacobian, twist, float(singular_value_threshold))
    if velocity is None:
        _require_finite(jacobian, twist)
        velocity = _damped(jacobian, twist, singular_value_threshold, largest_damping)
    if not _limit(velocity, np.ascontiguousarray(velocity_limits_rad_s)):
        _require_finite(jacobian, twist)
        raise ValueError("velocity_limits_rad_s holds a value that is not above 0; valid: above 0, rad/s")
    return velocity


def _undamped(jacobian: FloatArray, twist: FloatArray, threshold: float) -> FloatArray | None:
    """The exact or least-squares velocities (n,); None unless every singular value is above `threshold`.

    By the normal equations of the shorter side: J Jᵀ y = v and q = Jᵀ y, or JᵀJ q = Jᵀ v with fewer than six joints.
    Singular values from 0.06 to 3 make a condition of 2500, so that squaring them takes few of the digits.
    """
    wide = jacobian.shape[1] >= jacobian.shape[0]
    rows = np.ascontiguousarray(jacobian if wide else jacobian.T)
    solution = np.array(twist if wide else rows @ twist, dtype=np.float64)
    if not _solve_gram(rows, threshold, solution):
        return None
    return solution @ rows if wide else solution


def _damped(jacobian: FloatArray, twist: FloatArray, threshold: float, largest_damping: float) -> FloatArray:
    """The damped velocities (n,), by the singular values."""
    left, singular_values, right = np.linalg.svd(jacobian, full_matrices=False)
    nearness = min(singular_values[-1] / threshold, 1.0)
    damping_squared = largest_damping**2 * (1.0 - nearness**2)
    gains = singular_values / (singular_values**2 + damping_squared)
    velocity: FloatArray = right.T @ (gains * (left.T @ twist))
    return velocity


def _require_finite(jacobian: FloatArray, twist: FloatArray) -> None:
    for name, values in (("jacobian", jacobian), ("twist", twist)):
        if not np.isfinite(values).all():
            raise ValueError(f"{name} holds NaN or infinity; valid: finite numbers")


@building_block
def _factorise(matrix: FloatArray, shift: float, factor: FloatArray) -> bool:
    """Cholesky's lower `factor` of a symmetric matrix less `shift` times 1; False where it is not positive definite."""
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


@compiled(input_array(2), NUMBER, output_array(1), returns=TRUTH)
def _solve_gram(rows: FloatArray, threshold: float, solution: FloatArray) -> bool:
    """Solve G x = `solution` in place, G = A Aᵀ for the matrix A of these rows; False unless A is well conditioned.

    The eigenvalues of G are the squares of A's singular values: all of these are above `threshold` where
    G - threshold² has a Cholesky factor. That costs a fraction of a singular value decomposition.
    """
    size = rows.shape[0]
    gram, factor = np.zeros((size, size)), np.zeros((size, size))
    for row in range(size):
        for column in range(size):
            for k in range(rows.shape[1]):
                gram[row, column] += rows[row, k] * rows[column, k]
    if not (_factorise(gram, threshold * threshold, factor) and _factorise(gram, 0.0, factor)):
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


@compiled(output_array(1), input_array(1), returns=TRUTH)
def _limit(velocity: FloatArray, limits: FloatArray) -> bool:
    """Slow all joints alike so that none is over its limit; False for what is no velocity or no limit."""
    excess = 1.0
    for joint in range(velocity.size):
        # An infinite limit is no limit; NaN fails the comparison.
        if not (limits[joint] > 0.0 and math.isfinite(velocity[joint])):
            return False
        excess = max(excess, abs(velocity[joint]) / limits[joint])
    for joint in range(velocity.size):
        velocity[joint] /= excess
    return True
