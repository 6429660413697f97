import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.protocol.view_messages import Shape, ShapeKind
from operator_side.viewing.console.drawing import compose
from operator_side.viewing.console.solids import box, solid_of

STILL = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
Size = tuple[float, float, float]


def shape(kind: ShapeKind, size: Size) -> Shape:
    solid = box()
    mesh = kind == "mesh"
    vertices, triangles = (solid.vertices.tobytes(), solid.triangles.tobytes()) if mesh else (b"", b"")
    return Shape(0, True, kind, size, STILL, vertices_m=vertices, triangles=triangles)


@pytest.mark.parametrize(
    ("kind", "size", "volume_m3", "loss"),
    [
        ("box", (0.1, 0.2, 0.3), 8 * 0.1 * 0.2 * 0.3, 0.0),
        ("mesh", (1.0, 1.0, 1.0), 8.0, 0.0),
        ("plane", (0.5, 0.5, 0.0), 8 * 0.25e-3, 0.0),
        ("sphere", (0.2, 0.0, 0.0), 4 / 3 * math.pi * 0.2**3, 0.06),
        ("ellipsoid", (0.1, 0.2, 0.3), 4 / 3 * math.pi * 0.1 * 0.2 * 0.3, 0.06),
        ("cylinder", (0.1, 0.3, 0.0), math.pi * 0.1**2 * 0.6, 0.02),
        ("capsule", (0.1, 0.3, 0.0), math.pi * 0.1**2 * 0.6 + 4 / 3 * math.pi * 0.1**3, 0.03),
    ],
)
def test_a_shape_is_drawn_closed_from_outside_and_as_large(
    kind: ShapeKind, size: Size, volume_m3: float, loss: float
) -> None:
    _, solid, scale = solid_of(shape(kind, size))
    a, b, c = np.moveaxis((solid.vertices.astype(np.float64) * scale)[solid.triangles], 1, 0)
    areas = np.cross(b - a, c - a)
    assert np.abs(areas.sum(axis=0)).max() < 1e-6
    volume = np.einsum("ij,ij->", a, areas) / 6.0
    assert volume_m3 * (1.0 - loss - 1e-5) <= volume <= volume_m3 * (1.0 + 1e-5)


def test_shapes_share_a_mesh_where_only_their_scale_differs() -> None:
    def key(kind: ShapeKind, size: Size) -> object:
        return solid_of(shape(kind, size))[0]

    assert key("box", (1.0, 2.0, 3.0)) == key("plane", (0.0, 0.0, 0.0))
    assert key("sphere", (1.0, 0.0, 0.0)) == key("ellipsoid", (1.0, 2.0, 3.0))
    assert key("capsule", (1.0, 2.0, 0.0)) != key("capsule", (1.0, 3.0, 0.0))


def test_poses_are_put_together_as_scipy_does() -> None:
    generator = np.random.default_rng(0)
    turns = [Rotation.random(50, rng=generator) for _ in range(2)]
    outer, inner = (
        np.concatenate([generator.normal(size=(50, 3)), turn.as_quat(scalar_first=True)], axis=1) for turn in turns
    )
    both = compose(outer, inner)
    np.testing.assert_allclose(both[:, :3], outer[:, :3] + turns[0].apply(inner[:, :3]), atol=1e-12)
    matrices = Rotation.from_quat(both[:, 3:], scalar_first=True).as_matrix()
    np.testing.assert_allclose(matrices, (turns[0] * turns[1]).as_matrix(), atol=1e-12)
