"""Overlap of the unit ball and an ellipsoid, by quadrature over plane sections: intersections of a disc and an ellipse.

Their areas are closed forms of the crossings, roots of a quartic. No fixed rule is accurate, because areas begin and
end like powers of 3/2. So the rule is adaptive: Gauss-Kronrod with 7 and 15 nodes.
"""

import math
from typing import Final

import numpy as np

from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, norm, scale

_TOLERANCE: Final = 1e-10
"""Largest accepted difference of both rules' volumes over a piece, in cubes of the radius. The finer rule's error is a
tenth of the difference."""
_NO_PUSH: Final = (0.0, 0.0, 0.0)
_TOLERANCE_OF_GRADIENT: Final = 1e-5
"""Largest accepted difference of both rules' gradients, in squares of the radius; gradients show corners that both
rules miss."""
_HARDLY: Final = 1e-4
"""Largest angle, in rad, by which an arc may seem to run backwards from rounding"""
_AT_POLE: Final = 1e-12
"""A section is a point below this square of its size, relative to the largest section's."""
_FINEST: Final = 1 << 12
"""Maximum number of pieces into which the range of sections is divided"""
_NODES: Final = np.array(
    [
        0.99145537112081263,
        0.94910791234275852,
        0.86486442335976907,
        0.74153118559939443,
        0.58608723546769113,
        0.40584515137739716,
        0.20778495500789846,
        0.0,
    ]
)
_FINE: Final = np.array(
    [
        0.02293532201052922,
        0.06309209262997855,
        0.10479001032225018,
        0.14065325971552591,
        0.16900472663926790,
        0.19035057806478540,
        0.20443294007529889,
        0.20948214108472782,
    ]
)
_COARSE: Final = np.array(
    [
        0.0,
        0.12948496616886969,
        0.0,
        0.27970539148927666,
        0.0,
        0.38183005050511894,
        0.0,
        0.41795918367346938,
    ]
)
"""Gauss weights of 7 nodes, 0 at the others. `_FINE`: Kronrod's weights of all 15 nodes, `_NODES`: their positions."""


@inlined
def _excess(angle: float, u: float, v: float, rho: float, alpha: float, beta: float) -> float:
    """Return the value of the ellipse's equation at an angle of the circle: <= 0 inside the ellipse."""
    x, y = (u + rho * math.cos(angle)) / alpha, (v + rho * math.sin(angle)) / beta
    return x * x + y * y - 1.0


@inlined
def _pair(half: float, rest: float) -> tuple[float, float]:
    """Return the two real roots of y² + 2 half y + rest; NaN if there are none."""
    inside = half * half - rest
    if inside < 0.0:
        return math.nan, math.nan
    far = -half - math.copysign(math.sqrt(inside), half)
    return far, rest / far if far != 0.0 else 0.0


@inlined
def _largest_root(a: float, b: float, c: float) -> float:
    """Return the largest real root of m³ + a m² + b m + c (Cardano), refined by Newton's method."""
    p, q = (b - a * a / 3.0) / 3.0, (a * (2.0 * a * a / 27.0 - b / 3.0) + c) / 2.0
    inside = q * q + p * p * p
    if inside >= 0.0:
        root = -math.copysign((abs(q) + math.sqrt(inside)) ** (1.0 / 3.0), q)
        m = root - (p / root if root != 0.0 else 0.0) - a / 3.0
    else:
        r = math.sqrt(-p)
        m = 2.0 * r * math.cos(math.acos(min(max(-q / (r * r * r), -1.0), 1.0)) / 3.0) - a / 3.0
    for _ in range(3):
        slope = (3.0 * m + 2.0 * a) * m + b
        if slope > 0.0:
            m -= (((m + a) * m + b) * m + c) / slope
    return m


@building_block
def _crossings(  # noqa: PLR0912
    u: float, v: float, rho: float, alpha: float, beta: float
) -> tuple[int, Vector, float]:
    """Return how many points of the circle lie on the ellipse, and their angles in rising order: three and a fourth.

    The excess is C0 + C1 cos φ + S1 sin φ + C2 cos 2φ, a quartic in tan(φ/2) (Ferrari). φ is first turned by one of
    four quarter turns, so that |excess| is greatest at φ = π. Then no root is at infinity.
    """
    p, q = 1.0 / (alpha * alpha), 1.0 / (beta * beta)
    c0 = u * u * p + v * v * q - 1.0 + 0.5 * rho * rho * (p + q)
    c1, s1, c2 = 2.0 * u * rho * p, 2.0 * v * rho * q, 0.5 * rho * rho * (p - q)
    turn, best, quarter, x1, y1, z2 = 0.0, -1.0, 0.0, c1, s1, c2
    for _ in range(4):
        if abs(c0 - x1 + z2) > best:
            best, turn, c1, s1, c2 = abs(c0 - x1 + z2), quarter, x1, y1, z2
        # φ = φ' + π/2: cos φ = -sin φ', sin φ = cos φ'.
        x1, y1, z2, quarter = y1, -x1, -z2, quarter + 0.5 * math.pi
    lead = c0 - c1 + c2
    count, first, second, third, fourth = 0, 0.0, 0.0, 0.0, 0.0
    if lead == 0.0:
        return count, (first, second, third), fourth
    b, c, d, e = 2.0 * s1 / lead, (2.0 * c0 - 6.0 * c2) / lead, 2.0 * s1 / lead, (c0 + c1 + c2) / lead
    shift = 0.25 * b
    f = c - 6.0 * shift * shift
    g = d - 2.0 * c * shift + 8.0 * shift * shift * shift
    h = e - d * shift + c * shift * shift - 3.0 * shift * shift * shift * shift
    # The largest root of m³ + f m² + (f²/4 - h) m - g²/8 is not negative.
    m = _largest_root(f, 0.25 * f * f - h, -0.125 * g * g)
    if m > 1e-14 * max(abs(f), math.sqrt(abs(h))):
        s = math.sqrt(2.0 * m)
        one, two = _pair(0.5 * s, 0.5 * f + m - 0.5 * g / s)
        three, four = _pair(-0.5 * s, 0.5 * f + m + 0.5 * g / s)
    else:
        # The quartic is even in y.
        low, high = _pair(0.5 * f, h)
        one, three = math.sqrt(low) if low >= 0.0 else math.nan, math.sqrt(high) if high >= 0.0 else math.nan
        two, four = -one, -three
    for y in (one, two, three, four):
        if not math.isnan(y):
            angle = 2.0 * math.atan(y - shift)
            for _ in range(2):
                value = c0 + c1 * math.cos(angle) + s1 * math.sin(angle) + c2 * math.cos(2.0 * angle)
                slope = s1 * math.cos(angle) - c1 * math.sin(angle) - 2.0 * c2 * math.sin(2.0 * angle)
                if abs(value) < 1e-2 * abs(slope):
                    angle -= value / slope
            angle = (angle + turn) % (2.0 * math.pi)
            # Insert the angle in order.
            if count == 0 or angle < first:
                first, second, third, fourth = angle, first, second, third
            elif count == 1 or angle < second:
                second, third, fourth = angle, second, third
            elif count == 2 or angle < third:
                third, fourth = angle, third
            else:
                fourth = angle
            count += 1
    return count, (first, second, third), fourth


@building_block
def _section(u: float, v: float, rho: float, alpha: float, beta: float) -> tuple[float, Vector, int]:
    """Return area, derivatives and sort of the intersection of a disc about (u, v) with an ellipse about the origin.

    The derivatives are by u, v and the disc's radius. Sorts: 0 empty, 1 the whole disc, 2 the whole ellipse, 3 a part
    of both. By Green's theorem, over the circle's arcs within the ellipse and the ellipse's arcs between them.
    """
    count, angles, last = _crossings(u, v, rho, alpha, beta)
    if count < 2:
        if _excess(0.0, u, v, rho, alpha, beta) <= 0.0:
            return math.pi * rho * rho, (0.0, 0.0, 2.0 * math.pi * rho), 1
        apart = (alpha - u) * (alpha - u) + v * v > rho * rho
        return (0.0, _NO_PUSH, 0) if apart else (math.pi * alpha * beta, _NO_PUSH, 2)
    area, along_u, along_v, arcs, any_arc = 0.0, 0.0, 0.0, 0.0, False
    for k in range(count):
        start = angles[k] if k < 3 else last
        end = angles[0] + 2.0 * math.pi if k + 1 == count else (angles[k + 1] if k + 1 < 3 else last)
        within = _excess(0.5 * (start + end), u, v, rho, alpha, beta) <= 0.0
        from_x, from_y = u + rho * math.cos(start), v + rho * math.sin(start)
        to_x, to_y = u + rho * math.cos(end), v + rho * math.sin(end)
        if within:
            any_arc = True
            area += 0.5 * (rho * rho * (end - start) + u * (to_y - from_y) - v * (to_x - from_x))
            along_u, along_v, arcs = along_u + to_y - from_y, along_v - (to_x - from_x), arcs + end - start
        else:
            # Arc of the ellipse from the circle's exit to its next entry.
            turn = math.atan2(to_y / beta, to_x / alpha) - math.atan2(from_y / beta, from_x / alpha)
            # Where rounding turns one crossing into two, both arcs are tiny.
            if turn < 0.0 and (turn < -_HARDLY or end - start > 1.0):
                turn += 2.0 * math.pi
            area += 0.5 * alpha * beta * turn
    if not any_arc:
        # The circle touches the ellipse from outside, or encloses it.
        apart = (alpha - u) * (alpha - u) + v * v > rho * rho
        return (0.0, _NO_PUSH, 0) if apart else (math.pi * alpha * beta, _NO_PUSH, 2)
    return area, (along_u, along_v, rho * arcs), 3


@building_block
def _slice(z: float, x: Vector, a: Vector) -> tuple[float, Vector, int]:
    """Return area, gradient by x, and sort of the section at height z.

    The section is through a unit ball about x and an ellipsoid with half axes a about the origin.
    """
    up = z - x[2]
    rho, size = math.sqrt(max(1.0 - up * up, 0.0)), math.sqrt(max(1.0 - z * z / (a[2] * a[2]), 0.0))
    if rho == 0.0 or size == 0.0:
        return 0.0, _NO_PUSH, 0
    area, (along_u, along_v, by_rho), sort = _section(x[0], x[1], rho, size * a[0], size * a[1])
    return area, (along_u, along_v, by_rho * up / rho), sort


@building_block
def _pole_sort(z: float, x: Vector, a: Vector) -> int:
    """Return the sort of sections next to a pole of the ball or the ellipsoid; -1 at any other height."""
    up, size_2 = z - x[2], 1.0 - z * z / (a[2] * a[2])
    if 1.0 - up * up < _AT_POLE:
        return 1 if (x[0] / a[0]) ** 2 + (x[1] / a[1]) ** 2 <= size_2 else 0
    if size_2 < _AT_POLE:
        return 2 if x[0] * x[0] + x[1] * x[1] + up * up <= 1.0 else 0
    return -1


@inlined
def _height(low: float, high: float, t: float) -> float:
    return low + (high - low) * t * t * (3.0 - 2.0 * t)


@building_block
def sum_slices(x: Vector, a: Vector, low: float, high: float) -> tuple[float, Vector]:
    """Return volume and gradient: integrals of the sections' areas and gradients from height `low` to height `high`.

    Pieces are halved until both rules agree. Heights are a cubic of t, in which the powers of 3/2 at `low` and `high`
    are smooth. Elsewhere each halving divides the error of such a power by 5. A piece is also halved if the sort of the
    section at one of its ends differs from the sort at the outermost node there.
    """
    volume, gradient, place, size, first, last = 0.0, (0.0, 0.0, 0.0), 0, _FINEST, 0, 0
    while place < _FINEST:
        half = 0.5 * size / _FINEST
        middle, fine, coarse, pushed, apart = place / _FINEST + half, 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for k in range(15):
            node = min(k, 14 - k)
            t = middle + math.copysign(half * _NODES[node], k - 7.0)
            area, gradient_here, sort = _slice(_height(low, high, t), x, a)
            weight = 6.0 * t * (1.0 - t) * (high - low) * half
            first, last = sort if k == 0 else first, sort
            fine, coarse = fine + _FINE[node] * weight * area, coarse + _COARSE[node] * weight * area
            pushed = add(pushed, scale(_FINE[node] * weight, gradient_here))
            apart = add(apart, scale((_FINE[node] - _COARSE[node]) * weight, gradient_here))
        agreed = abs(fine - coarse) <= _TOLERANCE and norm(apart) <= _TOLERANCE_OF_GRADIENT
        if agreed:
            sort = _pole_sort(low, x, a) if place == 0 else _slice(_height(low, high, middle - half), x, a)[2]
            agreed = sort in (first, -1)
        if agreed:
            sort = (
                _pole_sort(high, x, a)
                if place + size == _FINEST
                else _slice(_height(low, high, middle + half), x, a)[2]
            )
            agreed = sort in (last, -1)
        if size > 1 and not agreed:
            size //= 2
            continue
        volume, gradient, place = volume + fine, add(gradient, pushed), place + size
        while place % (2 * size) == 0 and place + 2 * size <= _FINEST:
            size *= 2
    return volume, gradient


@inlined
def reach_up(normal_z: float, distance: float) -> float:
    """Return the greatest height in the part of the unit ball where n·p <= -distance; normal_z: height of n."""
    if -normal_z >= distance:
        return 1.0
    across = max(1.0 - distance * distance, 0.0) * max(1.0 - normal_z * normal_z, 0.0)
    return math.sqrt(across) - normal_z * distance


@inlined
def rolled(vector: Vector, by: int) -> Vector:
    """Return the vector with its axes rolled, so that axis `by` is the last one."""
    if by == 0:
        return vector[1], vector[2], vector[0]
    return (vector[2], vector[0], vector[1]) if by == 1 else vector
