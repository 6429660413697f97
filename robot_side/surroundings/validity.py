"""Whether what the camera reports can be: checked once for each frame, so that no tick has to."""

import math
import sys
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray, require_finite
from robot_side.compiled.kernel import TRUTH, compiled, inlined, input_array, together
from robot_side.surroundings.kinds.kind import Check
from robot_side.surroundings.perceived import KINDS, PerceivedObjects

_UNIT_TOLERANCE = 1e-6
_LOWEST = -sys.float_info.max
"""The least finite number."""
_FIELDS: Final = tuple((kind.owner, *array) for kind in KINDS for array in kind.arrays)
"""Each array with the field that counts its rows."""
_CHECKED: Final = tuple(array for kind in KINDS for array in kind.arrays if array.check is not Check.INDEX)


def require_valid(objects: PerceivedObjects) -> None:
    """Raise a ValueError that names the field of `objects` that no primitive can have, or that no kernel can read.

    A number that is not finite would compare as far away and silently give no warning, and a kernel does not look
    where an array ends.
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
        if velocities.shape != (len(objects.names), 3):
            raise ValueError(
                f"objects.velocities_m_s holds {_described(velocities)}; valid: a row of 3 for each of"
                f" {len(objects.names)} objects"
            )
        require_finite("objects.velocities_m_s", velocities)
    if not _are_possible(tuple([getattr(objects, array.name) for array in _CHECKED])):
        _refuse(objects)


def _require_known_meshes(objects: PerceivedObjects) -> None:
    """Raise a ValueError unless each mesh is one of the library's."""
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
    """Raise the ValueError that says which number it is."""
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


@inlined
def _are_unit(values: FloatArray, columns: int) -> bool:
    """Whether matrices (3, columns), one after another, have unit columns at right angles."""
    for start in range(0, values.size, 3 * columns):
        for first in range(columns):
            for second in range(first + 1):
                product = -1.0 if first == second else 0.0
                for axis in range(start, start + 3 * columns, columns):
                    product += values[axis + first] * values[axis + second]
                # NaN fails the comparison.
                if not abs(product) <= _UNIT_TOLERANCE:
                    return False
    return True


@inlined
def _are_at_least(values: FloatArray, least: float) -> bool:
    """Whether all are at least `least` and finite."""
    largest = 0.0
    for value in values:
        if not value >= least:
            return False
        largest = max(largest, value)
    return largest < math.inf


def _checks(number: int) -> Any:
    """Make the function of all checked arrays that says whether those from `number` on can be."""
    check: Check = _CHECKED[number].check
    others: Any = _checks(number + 1) if number + 1 < len(_CHECKED) else None
    columns = {Check.UNIT: 1, Check.ORTHONORMAL: 3}.get(check, 0)
    least = 0.0 if check is Check.NOT_NEGATIVE else _LOWEST

    @inlined
    def this(arrays: Any) -> bool:
        values = arrays[number].ravel()
        return _are_unit(values, columns) if columns > 0 else _are_at_least(values, least)

    @inlined
    def this_and_others(arrays: Any) -> bool:
        return this(arrays) and others(arrays)

    return this if others is None else this_and_others


_all_can_be = _checks(0)


@compiled(together(*(input_array(1 + len(array.row)) for array in _CHECKED)), returns=TRUTH)
def _are_possible(arrays: Any) -> bool:
    return bool(_all_can_be(arrays))
