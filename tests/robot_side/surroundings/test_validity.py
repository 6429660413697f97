import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.validity import require_valid
from tests.helpers.perceived_scenes import Scene, random_scene

_NUMBERS = [
    "sphere_centers_m",
    "sphere_radii_m",
    "box_centers_m",
    "box_rotations",
    "box_half_sizes_m",
    "tetrahedron_vertices_m",
    "half_space_normals",
    "half_space_offsets_m",
]
_INDICES = ["sphere_object", "box_object", "tetrahedron_object", "half_space_object"]


def _changed(field: str, change: Callable[[Any], Any]) -> PerceivedObjects:
    objects = random_scene(np.random.default_rng(0), 3)
    return dataclasses.replace(objects, **{field: change(getattr(objects, field))})


@pytest.mark.parametrize("of_each_kind", [0, 1, 20])
def test_what_can_be_is_accepted(of_each_kind: int) -> None:
    require_valid(random_scene(np.random.default_rng(of_each_kind), of_each_kind))
    require_valid(Scene().add().sphere([1.0, 2.0, 3.0], 0.0).box([0.0, 0.0, 0.0], [0.0, 1.0, 1.0]).objects())


@pytest.mark.parametrize("field", _NUMBERS)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_each_number_must_be_finite(field: str, bad: float) -> None:
    def spoil(values: Any) -> Any:
        values = values.copy()
        values.reshape(-1)[-1] = bad
        return values

    with pytest.raises(ValueError, match=f"objects.{field}"):
        require_valid(_changed(field, spoil))


@pytest.mark.parametrize(
    ("field", "factor", "said"),
    [
        ("sphere_radii_m", -1.0, "negative"),
        ("box_half_sizes_m", -1.0, "negative"),
        ("box_rotations", 1.0 + 1e-6, "off unit length"),
        ("half_space_normals", 1.0 + 1e-6, "off unit length"),
    ],
)
def test_sizes_are_positive_and_directions_unit(field: str, factor: float, said: str) -> None:
    with pytest.raises(ValueError, match=f"objects.{field} .*{said}"):
        require_valid(_changed(field, lambda values: factor * values))


def test_axes_at_other_than_right_angles_are_named() -> None:
    shear = np.eye(3)
    shear[0, 1] = 1e-5
    with pytest.raises(ValueError, match=r"objects\.box_rotations .* right angle"):
        require_valid(_changed("box_rotations", lambda values: values @ shear))


@pytest.mark.parametrize("field", [*_NUMBERS, *_INDICES])
@pytest.mark.parametrize(
    "change",
    [
        lambda values: np.repeat(values, 2, axis=0)[::2],
        lambda values: values.astype(np.float32),
        lambda values: values[..., None],
    ],
    ids=["not contiguous", "another type", "another shape"],
)
def test_an_array_that_a_kernel_cannot_read_is_named(field: str, change: Callable[[Any], Any]) -> None:
    with pytest.raises(ValueError, match=f"objects.{field} holds"):
        require_valid(_changed(field, change))


@pytest.mark.parametrize("field", _NUMBERS)
def test_a_missing_row_is_found_before_a_kernel_reads_past_the_end(field: str) -> None:
    with pytest.raises(ValueError, match=f"objects.{field} holds .* in the shape"):
        require_valid(_changed(field, lambda values: values[:-1]))


@pytest.mark.parametrize("owner", _INDICES)
@pytest.mark.parametrize("bad", [-1, 99])
def test_each_primitive_belongs_to_an_object_that_is_there(owner: str, bad: int) -> None:
    """A primitive without an object would not get into the scene's table, and so would not be felt."""
    with pytest.raises(ValueError, match=rf"objects\.{owner} holds .*valid: 0 to"):
        require_valid(_changed(owner, lambda owners: np.where(np.arange(len(owners)) == 1, bad, owners)))


def test_each_object_has_a_role() -> None:
    with pytest.raises(ValueError, match=r"objects\.roles holds 0; valid: one for each"):
        require_valid(_changed("roles", lambda _: ()))
