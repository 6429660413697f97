"""Perceived objects that a kernel could misread are refused, by the name of the array."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from robot_side.surroundings.validity import require_valid
from tests.helpers.perceived_scenes import Scene, random_scene

NUMBERS = (
    *("sphere_centers_m", "sphere_radii_m", "box_centers_m", "box_rotations", "box_half_sizes_m"),
    *("tetrahedron_vertices_m", "half_space_normals", "half_space_offsets_m", "mesh_positions_m", "mesh_rotations"),
)
INDICES = ("sphere_object", "box_object", "tetrahedron_object", "half_space_object", "mesh_object")
Change = Callable[[Any], Any]


@pytest.mark.parametrize("of_each_kind", [0, 1, 20])
def test_what_can_be_is_accepted(of_each_kind: int) -> None:
    require_valid(random_scene(np.random.default_rng(of_each_kind), of_each_kind))
    require_valid(Scene().add().sphere([1.0, 2.0, 3.0], 0.0).box([0.0, 0.0, 0.0], [0.0, 1.0, 1.0]).objects())


def with_at(place: int, bad: float) -> Change:
    """Return a change that replaces one number of an array by `bad`."""
    return lambda values: np.where(np.arange(values.size) == place % values.size, bad, values.ravel()).reshape(
        values.shape
    )


SHEAR = np.eye(3) + 1e-5 * np.eye(3, k=1)
UNREADABLE: dict[str, Change] = {
    "not contiguous": lambda values: np.repeat(values, 2, axis=0)[::2],
    "another type": lambda values: values.astype(np.float32),
    "another shape": lambda values: values[..., None],
}
REFUSED: list[tuple[str, Change, str]] = [
    *((field, with_at(-1, bad), "") for field in NUMBERS for bad in (math.nan, math.inf, -math.inf)),
    *((field, change, " holds") for field in (*NUMBERS, *INDICES) for change in UNREADABLE.values()),
    # A kernel would read past the end.
    *((field, lambda values: values[:-1], " holds .* in the shape") for field in NUMBERS),
    # A primitive without an object would not get into the scene's table, and so would not be felt.
    *((owner, with_at(1, bad), " holds .*valid: 0 to") for owner in INDICES for bad in (-1, 99)),
    *((sizes, lambda values: -values, " .*negative") for sizes in ("sphere_radii_m", "box_half_sizes_m")),
    *(
        (axes, lambda values: 1.000001 * values, " .*off unit length")
        for axes in ("box_rotations", "half_space_normals")
    ),
    ("box_rotations", lambda values: values @ SHEAR, " .* right angle"),
    ("roles", lambda _: (), " holds 0 roles; valid: one for each"),
]


@pytest.mark.parametrize(("field", "change", "said"), REFUSED)
def test_what_cannot_be_is_named(field: str, change: Change, said: str) -> None:
    objects = random_scene(np.random.default_rng(0), 3, meshes=2)
    with pytest.raises(ValueError, match=rf"objects\.{field}{said}"):
        require_valid(dataclasses.replace(objects, **{field: change(getattr(objects, field))}))
