"""Area of a face inside the ball, and the part of the sphere's surface that it covers, as sums over the face's edges.

The origin is the sphere's centre. By the divergence theorem the overlap with a solid of flat faces is
Σ (h A + R S) / 3 over the faces. h is a face's signed distance along its outward normal, A its area inside the ball,
and S the part of the sphere's surface that lies within the solid as far as this face bounds it. Each face is a sum over
the triangles of its edges with the face's foot point, the point of its plane nearest to the centre. d is an edge's
signed distance from the foot point, and `inside` the length of the edge inside the ball:

    A = Σ d·inside/2 + (R² - h²) φ/2,     S = R sign(h) (R Ω - (R - |h|) φ)

φ is the sum of the angles at the foot point that the parts of the edges outside the ball subtend. Ω is the solid angle
at the centre of the triangles that the foot point makes with these parts. The sums need no decision about an edge (is
it cut?) or the foot point (where does it lie?), so rounding cannot reverse one. They are continuous in all inputs, also
at tangents and corners, and hold for every closed oriented surface.

Each part, from t to t' along the edge, adds to φ the angle of the complex number (d² + t·t', d |t' - t|). It adds to
Ω/2 the angle of van Oosterom and Strackee (1983) for such a triangle. Angles are summed by multiplying the complex
numbers. So one arctangent each for φ and Ω suffices, and no branch is needed.
"""

import math

from robot_side.compiled.kernel import inlined
from robot_side.overlap.digits.arctangent import arctangent
from robot_side.overlap.solids.split_edge import OutsidePart, SplitEdge

Turn = tuple[float, float]
"""Angle as (cosine, sine), both times any positive factor"""

EdgeTerms = tuple[float, Turn, Turn]
"""One edge's terms in the sum of a face: (d·inside in m², turn by the part of φ, turn by the part of Ω/2)"""

FaceSum = tuple[float, Turn, float, Turn]
"""Sum over a face's edges so far: (Σ d·inside in m², turn by φ, number of whole turns in φ, turn by Ω/2)"""


@inlined
def edge_terms(edge: SplitEdge, distance: float, depth: float) -> EdgeTerms:
    """Return the terms of `edge` in a face at the distance `depth` = |h| (m) from the sphere's centre.

    `distance` is d (m), from the face's foot point to the edge's line. It is positive where the edge runs anticlockwise
    round the foot point, as seen from outside.
    """
    inside, before, before_norms, after, after_norms = edge
    first_plane, first_solid = _part_turns(before, before_norms, distance, depth)
    last_plane, last_solid = _part_turns(after, after_norms, distance, depth)
    return distance * inside, multiply(first_plane, last_plane), multiply(first_solid, last_solid)


@inlined
def _part_turns(part: OutsidePart, norms: float, distance: float, depth: float) -> tuple[Turn, Turn]:
    length, product, norm_product = part
    outside = length > 0.0
    sine = distance * length if outside else 0.0
    # Up to rounding, both cosines are at least 0: no part turns by more than a right angle.
    plane_cosine = distance * distance + product if outside else 1.0
    solid_cosine = norm_product + depth * norms if outside else 1.0
    return (plane_cosine, sine), (solid_cosine, sine)


@inlined
def multiply(a: Turn, b: Turn) -> Turn:
    """Return the turn by the sum of two angles."""
    return a[0] * b[0] - a[1] * b[1], a[1] * b[0] + a[0] * b[1]


@inlined
def first_edge(terms: EdgeTerms) -> FaceSum:
    """Return the sum that has the terms of one edge only."""
    return terms[0], terms[1], 0.0, terms[2]


@inlined
def add_edge(total: FaceSum, terms: EdgeTerms) -> FaceSum:
    """Return the sum with another edge's terms added.

    φ may reach a whole turn, so its passages through ±π are counted. Ω/2 reaches half a turn at most.
    """
    triangle, plane, turns, solid = total
    turned = multiply(plane, terms[1])
    up = 1.0 if (plane[1] >= 0.0) & (terms[1][1] >= 0.0) & (turned[1] < 0.0) else 0.0
    down = 1.0 if (plane[1] < 0.0) & (terms[1][1] < 0.0) & (turned[1] >= 0.0) else 0.0
    return triangle + terms[0], turned, turns + (up - down), multiply(solid, terms[2])


@inlined
def face_areas(height: float, total: FaceSum, radius: float) -> tuple[float, float]:
    """Return (A, S) in m² of the face at the signed distance `height`, from the sum of its edges."""
    triangle, plane, turns, solid = total
    depth = abs(height)
    gap = max(radius - depth, 0.0)
    plane_angle = arctangent(plane[1], plane[0]) + 2.0 * math.pi * turns
    half_solid_angle = arctangent(solid[1], solid[0])
    # Ω/2 lies in [0, π]: an angle that rounds past π returns as -π.
    half_solid_angle += 2.0 * math.pi if half_solid_angle < -0.5 * math.pi else 0.0
    disc = 0.5 * (triangle + gap * (radius + depth) * plane_angle)
    covered = radius * (2.0 * radius * half_solid_angle - gap * plane_angle)
    return disc, covered if height > 0.0 else (-covered if height < 0.0 else 0.0)
