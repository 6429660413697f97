"""Whether what the camera reports can be: checked once for each frame, so that no tick has to."""

import math
import sys

import numpy as np

from common.arrays import FloatArray, require_finite
from robot_side.compiled.kernel import TRUTH, compiled, inlined, input_array
from robot_side.objects.perceived import PerceivedObjects

_UNIT_TOLERANCE = 1e-6
_LOWEST = -sys.float_info.max
"""The least finite number."""

_FIELDS = (
    ("sphere_object", "sphere_centers_m", (3,)),
    ("sphere_object", "sphere_radii_m", ()),
    ("box_object", "box_centers_m", (3,)),
    ("box_object", "box_rotations", (3, 3)),
    ("box_object", "box_half_sizes_m", (3,)),
    ("tetrahedron_object", "tetrahedron_vertices_m", (4, 3)),
    ("mesh_object", "mesh_positions_m", (3,)),
    ("mesh_object", "mesh_rotations", (3, 3)),
    ("half_space_object", "half_space_normals", (3,)),
    ("half_space_object", "half_space_offsets_m", ()),
)
"""Each field with the one that counts its rows, and the shape of a row."""


def require_valid(objects: PerceivedObjects) -> None:
    """Raise a ValueError that names the field of `objects` that no primitive can have, or that no kernel can read.

    A number that is not finite would compare as far away and silently give no warning, and a kernel does not look
    where an array ends.
    """
    for owner, name, row in _FIELDS:
        indices, values = getattr(objects, owner), getattr(objects, name)
        if indices.dtype != np.int64 or indices.ndim != 1 or not indices.flags.c_contiguous:
            raise ValueError(f"objects.{owner} holds {_described(indices)}; valid: contiguous int64 in the shape (k,)")
        shape = (indices.size, *row)
        if values.dtype != np.float64 or values.shape != shape or not values.flags.c_contiguous:
            raise ValueError(
                f"objects.{name} holds {_described(values)}; valid: contiguous float64 in the shape {shape}"
            )
    _require_known_meshes(objects)
    velocities = objects.velocities_m_s
    if velocities is not None:
        if velocities.shape != (len(objects.names), 3):
            raise ValueError(
                f"objects.velocities_m_s holds {_described(velocities)}; valid: a row of 3 for each of"
                f" {len(objects.names)} objects"
            )
        require_finite("objects.velocities_m_s", velocities)
    if not _are_possible(*(getattr(objects, name) for _, name, _ in _FIELDS)):
        _refuse(objects)


def _require_known_meshes(objects: PerceivedObjects) -> None:
    """Raise a ValueError unless each mesh is one of the library's."""
    indices, count = objects.mesh_index, objects.mesh_object.size
    if indices.dtype != np.int64 or indices.shape != (count,) or not indices.flags.c_contiguous:
        raise ValueError(
            f"objects.mesh_index holds {_described(indices)}; valid: contiguous int64 in the shape ({count},)"
        )
    if count == 0:
        return
    if objects.mesh_library is None:
        raise ValueError(f"objects.mesh_library is None with {count} meshes placed; valid: the library of their shapes")
    known = len(objects.mesh_library)
    if indices.min() < 0 or indices.max() >= known:
        raise ValueError(f"objects.mesh_index holds {indices.min()} to {indices.max()}; valid: 0 to {known - 1}")


def _described(values: np.ndarray) -> str:
    return f"{values.dtype} in the shape {values.shape} and steps of {values.strides}"


def _refuse(objects: PerceivedObjects) -> None:
    """Raise the ValueError that says which number it is."""
    for _, name, _ in _FIELDS:
        require_finite(f"objects.{name}", getattr(objects, name))
    for name in ("sphere_radii_m", "box_half_sizes_m"):
        values = getattr(objects, name)
        if (values < 0.0).any():
            raise ValueError(f"objects.{name} = {values.min()} is negative; valid: 0 or more")
    errors = {
        name: np.abs(rotations.swapaxes(1, 2) @ rotations - np.eye(3))
        for name, rotations in (("box_rotations", objects.box_rotations), ("mesh_rotations", objects.mesh_rotations))
    }
    squared = np.einsum("hi,hi->h", objects.half_space_normals, objects.half_space_normals)
    for name, error in (errors | {"half_space_normals": np.abs(squared - 1.0)}).items():
        if (error > _UNIT_TOLERANCE).any():
            raise ValueError(
                f"objects.{name} is {error.max():.1e} off unit length or a right angle; valid: at most 1e-6"
            )


@inlined
def _are_at_least(values: FloatArray, least: float) -> bool:
    """Whether all are at least `least` and finite."""
    largest = 0.0
    for value in values.ravel():
        # NaN fails the comparison.
        if not value >= least:
            return False
        largest = max(largest, value)
    return largest < math.inf


@inlined
def _are_orthonormal(rotations: FloatArray) -> bool:
    for k in range(rotations.shape[0]):
        for first in range(3):
            for second in range(first + 1):
                product = -1.0 if first == second else 0.0
                for axis in range(3):
                    product += rotations[k, axis, first] * rotations[k, axis, second]
                if not abs(product) <= _UNIT_TOLERANCE:
                    return False
    return True


@inlined
def _are_unit(vectors: FloatArray) -> bool:
    for k in range(vectors.shape[0]):
        squared = vectors[k, 0] ** 2 + vectors[k, 1] ** 2 + vectors[k, 2] ** 2
        if not abs(squared - 1.0) <= _UNIT_TOLERANCE:
            return False
    return True


@compiled(
    *(input_array(2), input_array(1)),
    *(input_array(2), input_array(3), input_array(2)),
    input_array(3),
    *(input_array(2), input_array(3)),
    *(input_array(2), input_array(1)),
    returns=TRUTH,
)
def _are_possible(
    sphere_centers: FloatArray,
    sphere_radii: FloatArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    vertices: FloatArray,
    mesh_positions: FloatArray,
    mesh_rotations: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
) -> bool:
    return (
        _are_at_least(sphere_centers, _LOWEST)
        and _are_at_least(sphere_radii, 0.0)
        and _are_at_least(box_centers, _LOWEST)
        and _are_orthonormal(box_rotations)
        and _are_at_least(box_half_sizes, 0.0)
        and _are_at_least(vertices, _LOWEST)
        and _are_at_least(mesh_positions, _LOWEST)
        and _are_orthonormal(mesh_rotations)
        and _are_unit(normals)
        and _are_at_least(offsets, _LOWEST)
    )
