"""Outlines of objects in the first-person view, against places worked out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from viser.transforms import SO3

from common.protocol.view_messages import Eye, Shape, ShapeKind
from operator_side.viewing.console.outlines import Floats, corners_m, moved, outline, rotation

STILL = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
EYE = Eye((0.0, 0.1, -0.2), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 90.0)
"""Above and behind the tool; half the picture's height is the distance ahead"""
TETRAHEDRON = np.array([(-0.1, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.2)], np.float32)


def at(z_m: float, shape: Shape, x_m: float = 0.0) -> Floats:
    """Return the corners of the box around `shape`, in the world frame."""
    return moved(np.array((x_m, 0.1, z_m, *STILL[3:])), corners_m(shape))


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
    box = outline(at(0.8, Shape(0, False, kind, size_m, STILL)), np.array(STILL), EYE)
    face_m = 0.8 + 0.2 - deep
    assert box == pytest.approx((-across / face_m, -above / face_m, across / face_m, above / face_m))


def test_right_is_by_the_eye_and_the_tools_pose_counts() -> None:
    """The eye looks along z with y up, so its right is -x; the tool is moved, and the mesh with it."""
    mesh = Shape(0, False, "mesh", (1.0, 1.0, 1.0), STILL, vertices_m=TETRAHEDRON.tobytes(), triangles=bytes(12))
    box = outline(at(0.8, mesh, 5.5), np.array((5.0, 0.0, 0.0, *STILL[3:])), EYE)
    assert box == pytest.approx((-0.6, 0.0, -0.4 / 1.2, 0.3))


def test_what_is_partly_behind_the_eye_has_none() -> None:
    ball = Shape(0, False, "sphere", (0.1, 0.0, 0.0), STILL)
    assert outline(at(-0.15, ball), np.array(STILL), EYE) is None


@given(arrays(float, 4, elements=st.floats(-1.0, 1.0)).filter(lambda q: bool(np.linalg.norm(q) > 0.1)))
def test_a_rotation_is_that_of_viser(quaternion: Floats) -> None:
    unit = quaternion / np.linalg.norm(quaternion)
    assert rotation(np.concatenate((np.zeros(3), unit))) == pytest.approx(SO3(unit).as_matrix(), abs=1e-14)
