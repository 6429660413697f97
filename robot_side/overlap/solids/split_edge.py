"""Split of an edge into its parts before, inside and after the ball; both faces of the edge use the same split.

The code has no branches, for the vectorised loops.
"""

import math

from robot_side.compiled.kernel import inlined

OutsidePart = tuple[float, float, float]
"""Part of an edge outside the ball, from the point P to P' relative to the sphere's centre: (t' - t, t·t', |P||P'| +
P·P'). t and t' are the points' signed distances (m) along the edge, from the line's point nearest to the centre."""

SplitEdge = tuple[float, OutsidePart, float, OutsidePart, float]
"""(inside, before, before_norms, after, after_norms). `inside` (m) is the length of the edge in the ball. `before` and
`after` are the parts outside, each followed by the sum |P| + |P'| (m) of the distances of its ends."""


@inlined
def split_edge(start: float, end: float, start_norm: float, end_norm: float, foot_2: float, radius: float) -> SplitEdge:
    """Split the edge that runs from `start` to `end`, signed distances (m) from the foot of its line.

    The foot is the line's point nearest to the sphere's centre, at the squared distance `foot_2` (m²). The ends are
    `start_norm` and `end_norm` (m) away from the centre.
    """
    rest_2 = radius * radius - foot_2
    reached = rest_2 > 0.0
    root = math.sqrt(rest_2 if reached else foot_2)
    # A line that misses the ball is split at its foot, or at the end nearest to that: any point is correct.
    half_chord = root if reached else 0.0
    split_norm = radius if reached else root
    entry = min(max(-half_chord, start), end)
    leave = max(min(half_chord, end), start)
    entry_norm = start_norm if -half_chord < start else (end_norm if -half_chord > end else split_norm)
    leave_norm = start_norm if half_chord < start else (end_norm if half_chord > end else split_norm)
    before = _outside_part(start, entry, start_norm * entry_norm, foot_2)
    after = _outside_part(leave, end, leave_norm * end_norm, foot_2)
    return leave - entry, before, start_norm + entry_norm, after, leave_norm + end_norm


@inlined
def _outside_part(first: float, last: float, norms: float, foot_2: float) -> OutsidePart:
    product = first * last
    return last - first, product, norms + (product + foot_2)
