"""Outlines of objects in the first-person view, against places worked out by hand."""

import numpy as np
import pytest

from common.protocol.view_messages import Eye, Shape, ShapeKind
from operator_side.viewing.console.outlines import outline

STILL = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
EYE = Eye((0.0, 0.1, -0.2), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 90.0)
"""Above and behind the tool; half the picture's height is the distance ahead"""
TETRAHEDRON = np.array([(-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.2)], np.float32)


def at(z_m: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array((0.0, 0.1, z_m, 1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("kind", "size_m", "across", "above", "deep"),
    [
        ("box", (0.1, 0.2, 0.3), 0.1, 0.2, 0.3),
        ("sphere", (0.1, 0.0, 0.0), 0.1, 0.1, 0.1),
        ("cylinder", (0.1, 0.2, 0.0), 0.1, 0.1, 0.2),
        ("capsule", (0.1, 0.2, 0.0), 0.1, 0.1, 0.3),
    ],
)
def test_the_nearer_face_is_the_outline_of_what_is_straight_ahead(
    kind: ShapeKind, size_m: tuple[float, float, float], across: float, above: float, deep: float
) -> None:
    box = outline([Shape(0, False, kind, size_m, STILL)], at(0.8), np.array(STILL), EYE)
    face_m = 0.8 + 0.2 - deep
    assert box == pytest.approx((-across / face_m, -above / face_m, across / face_m, above / face_m))


def test_right_is_by_the_eye_and_the_tools_pose_counts() -> None:
    """The eye looks along z with y up, so its right is -x; the tool is moved, and the mesh with it."""
    mesh = Shape(0, False, "mesh", (1.0, 1.0, 1.0), STILL, vertices_m=TETRAHEDRON.tobytes())
    moved = np.array((5.0, 0.0, 0.0, *STILL[3:]))
    box = outline([mesh], at(0.8) + moved * [1, 0, 0, 0, 0, 0, 0] + [0.5, 0, 0, 0, 0, 0, 0], moved, EYE)
    assert box == pytest.approx((-0.6, 0.0, -0.4 / 1.2, 0.3))


def test_what_is_partly_behind_the_eye_or_nothing_has_none() -> None:
    ball = Shape(0, False, "sphere", (0.1, 0.0, 0.0), STILL)
    assert outline([ball], at(-0.15), np.array(STILL), EYE) is None
    assert outline([], at(0.8), np.array(STILL), EYE) is None
