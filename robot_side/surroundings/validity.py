"""Validation of the camera's frames, once for each frame."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.compiled.kernel import BOOL, building_block, compiled, inlined, input_array, input_indices
from robot_side.surroundings.kinds.kind import Check, Kind
from robot_side.surroundings.kinds.layout import NUMBERS
from robot_side.surroundings.perceived import KINDS, PerceivedObjects
from robot_side.surroundings.placing import numbers_of, primitives_of

_UNIT_TOLERANCE = 1e-6
_FIELDS: Final = tuple((kind.owner, *array) for kind in KINDS for array in kind.arrays)
"""For each array: the name of its kind's `*_object` field, then name, shape of a row, and check"""
_CHECKED: Final = tuple(array for kind in KINDS for array in kind.arrays if array.check is not Check.INDEX)


def require_valid(objects: PerceivedObjects) -> None:
    """Raise a ValueError that names the field of `objects` whose numbers, type or shape are invalid.

    A NaN would count as far away and silently give no warning. Kernels do not check the bounds of arrays.
    """
    for owner, name, row, check in _FIELDS:
        indices, values = getattr(objects, owner), getattr(objects, name)
        if indices.dtype != np.int64 or indices.ndim != 1 or not indices.flags.c_contiguous:
            raise ValueError(f"objects.{owner} holds {_described(indices)}; valid: contiguous int64 in the shape (k,)")
        shape, wanted = (indices.size, *row), np.int64 if check is Check.INDEX else np.float64
        if values.dtype != wanted or values.shape != shape or not values.flags.c_contiguous:
            raise ValueError(
                f"objects.{name} holds {_described(values)}; valid: contiguous {wanted.__name__} in the shape {shape}"
            )
        if indices.size and (indices.min() < 0 or indices.max() >= len(objects.names)):
            raise ValueError(
                f"objects.{owner} holds {indices.min()} to {indices.max()}; valid: 0 to {len(objects.names) - 1}"
            )
    if len(objects.roles) != len(objects.names):
        raise ValueError(f"objects.roles holds {len(objects.roles)}; valid: one for each of {len(objects.names)} names")
    _require_known_meshes(objects)
    velocities = objects.velocities_m_s
    if velocities is not None:
        as_floats = velocities.dtype == np.float64 and velocities.flags.c_contiguous
        if velocities.shape != (len(objects.names), 3) or not as_floats:
            raise ValueError(
                f"objects.velocities_m_s holds {_described(velocities)}; valid: contiguous float64, a row of 3 for each"
                f" of {len(objects.names)} objects"
            )
        require_finite("objects.velocities_m_s", velocities)
    if not _are_possible(numbers_of(objects), primitives_of(objects).kinds):
        _refuse(objects)


def _require_known_meshes(objects: PerceivedObjects) -> None:
    """Raise a ValueError unless the frame's mesh library has each mesh."""
    indices = objects.mesh_index
    if indices.size == 0:
        return
    if objects.mesh_library is None:
        raise ValueError(
            f"objects.mesh_library is None with {indices.size} meshes placed; valid: the library of their shapes"
        )
    known = len(objects.mesh_library)
    if indices.min() < 0 or indices.max() >= known:
        raise ValueError(f"objects.mesh_index holds {indices.min()} to {indices.max()}; valid: 0 to {known - 1}")


def _described(values: np.ndarray) -> str:
    return f"{values.dtype} in the shape {values.shape} and steps of {values.strides}"


def _refuse(objects: PerceivedObjects) -> None:
    """Raise the ValueError that names the invalid array."""
    for name, _, check in _CHECKED:
        values = getattr(objects, name)
        require_finite(f"objects.{name}", values)
        if check is Check.NOT_NEGATIVE and (values < 0.0).any():
            raise ValueError(f"objects.{name} = {values.min()} is negative; valid: 0 or more")
        if check in (Check.UNIT, Check.ORTHONORMAL):
            columns = values.reshape(len(values), 3, 3 if check is Check.ORTHONORMAL else 1)
            error = np.abs(columns.swapaxes(1, 2) @ columns - np.eye(columns.shape[2]))
            if (error > _UNIT_TOLERANCE).any():
                raise ValueError(
                    f"objects.{name} is {error.max():.1e} off unit length or a right angle; valid: at most 1e-6"
                )


_ANY, _FINITE, _LEAST_0, _UNIT, _ORTHONORMAL = range(5)


def _codes(kind: Kind) -> list[int]:
    """Return the code of the check of each of a primitive's 20 numbers.

    The check of a vector or a matrix is at the first of its numbers.
    """
    codes = [_ANY] * NUMBERS
    for array in kind.arrays:
        if array.name in kind.parts:
            part = kind.parts[array.name][0]
            codes[part] = [_LEAST_0 if array.check is Check.NOT_NEGATIVE else _FINITE] * (part.stop - part.start)
            codes[part.start] = {Check.UNIT: _UNIT, Check.ORTHONORMAL: _ORTHONORMAL}.get(array.check, codes[part.start])
    return codes


_CODES: Final = np.array([_codes(kind) for kind in KINDS])


@inlined
def _are_unit(numbers: FloatArray, row: int, start: int, columns: int) -> bool:
    """Return whether the matrix (3, columns) that begins at `start` has unit columns at right angles."""
    for first in range(columns):
        for second in range(first + 1):
            product = -1.0 if first == second else 0.0
            for entry in range(start, start + 3 * columns, columns):
                product += numbers[row, entry + first] * numbers[row, entry + second]
            # NaN fails the comparison.
            if not abs(product) <= _UNIT_TOLERANCE:
                return False
    return True


@building_block
def is_possible(kind: int, numbers: FloatArray, row: int) -> bool:
    """Return whether the numbers (n, 20) in `row` are valid for a primitive of this kind."""
    for place in range(NUMBERS):
        code = _CODES[kind, place]
        if code != _ANY:
            value = numbers[row, place]
            if not math.isfinite(value) or (code == _LEAST_0 and value < 0.0):
                return False
            if code == _UNIT and not _are_unit(numbers, row, place, 1):
                return False
            if code == _ORTHONORMAL and not _are_unit(numbers, row, place, 3):
                return False
    return True


@compiled(input_array(2), input_indices(), returns=BOOL)
def _are_possible(numbers: FloatArray, kinds: IntArray) -> bool:
    possible = True
    for row in range(kinds.size):
        possible = possible and is_possible(kinds[row], numbers, row)
    return possible
