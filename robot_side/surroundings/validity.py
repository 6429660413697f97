"""Validation of the camera's frames, once for each frame."""

from typing import Final

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray, require_finite
from robot_side.surroundings.kinds.kind import Check
from robot_side.surroundings.perceived import KINDS, PerceivedObjects

_UNIT_TOLERANCE = 1e-6
_FIELDS: Final = tuple((kind.owner, *array) for kind in KINDS for array in kind.arrays)
"""For each array: the name of its kind's `*_object` field, then name, shape of a row, and check"""
_COLUMNS: Final = {Check.UNIT: 1, Check.ORTHONORMAL: 3}
"""Number of columns of a matrix (3, c) whose columns are unit vectors at right angles"""
_EYES: Final = {check: np.eye(count) for check, count in _COLUMNS.items()}


def _of_numbers() -> dict[tuple[int, int, Check], BoolArray]:
    """Return, for a part of a primitive's numbers and a check, whether this is to be checked in each kind."""
    found: dict[tuple[int, int, Check], BoolArray] = {}
    for number, kind in enumerate(KINDS):
        for array in kind.arrays:
            if array.check not in (Check.FINITE, Check.INDEX):
                part = kind.parts[array.name][0]
                key = part.start, part.stop, array.check
                found.setdefault(key, np.zeros(len(KINDS), dtype=np.bool_))[number] = True
    return found


_OF_NUMBERS: Final = _of_numbers()
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
                f"objects.{owner} holds indices from {indices.min()} to {indices.max()};"
                f" valid: 0 to {len(objects.names) - 1}"
            )
    if len(objects.roles) != len(objects.names):
        raise ValueError(
            f"objects.roles holds {len(objects.roles)} roles; valid: one for each of {len(objects.names)} objects"
        )
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
    _require_valid_errors_and_surfaces(objects)
    for name, _, check in _CHECKED:
        fault = _fault(getattr(objects, name), check)
        if fault is not None:
            raise ValueError(f"objects.{name}{fault}")


def _require_valid_errors_and_surfaces(objects: PerceivedObjects) -> None:
    """Raise a ValueError unless the errors of the positions, and the surfaces, are valid; a deviation may be NaN."""
    if (sds_m := objects.sds_m) is not None and (
        sds_m.shape != (len(objects.names),)
        or sds_m.dtype != np.float64
        or (sds_m < 0.0).any()
        or np.isinf(sds_m).any()
    ):
        raise ValueError(
            f"objects.sds_m holds {_described(sds_m)}; valid: float64, 0 or more or NaN for each of"
            f" {len(objects.names)} objects"
        )
    count = len(objects.names)
    if (surfaces := objects.surfaces) is not None and (
        surfaces.shape != (count,)
        or surfaces.dtype != np.int64
        or (count > 0 and not -1 <= surfaces.min() <= surfaces.max() < count)
    ):
        raise ValueError(
            f"objects.surfaces holds {_described(surfaces)}; valid: int64, from -1 to {count - 1} for each of"
            f" {count} objects"
        )
    for name, value in (("unseen_m", objects.unseen_m), ("late_s", objects.late_s)):
        if not 0.0 <= value < np.inf:
            raise ValueError(f"objects.{name} = {value}; valid: a finite number, 0 or more")


def _require_known_meshes(objects: PerceivedObjects) -> None:
    """Raise a ValueError unless the frame's mesh library has each mesh."""
    indices = objects.mesh_index
    if indices.size == 0:
        return
    if objects.mesh_library is None:
        raise ValueError(
            f"objects.mesh_library is None although {indices.size} meshes are placed; valid: the library of the meshes"
        )
    known = len(objects.mesh_library)
    if indices.min() < 0 or indices.max() >= known:
        raise ValueError(
            f"objects.mesh_index holds indices from {indices.min()} to {indices.max()}; valid: 0 to {known - 1}"
        )


def _described(values: np.ndarray) -> str:
    return f"{values.dtype} in the shape {values.shape} and steps of {values.strides}"


def _fault(values: FloatArray, check: Check) -> str | None:
    """Return what is invalid about the values (k, ...) of an array, with what would be valid; None if nothing is."""
    if not np.isfinite(values).all():
        return " holds NaN or infinity; valid: finite numbers"
    if check is Check.NOT_NEGATIVE and (values < 0.0).any():
        return f" = {values.min()} is negative; valid: 0 or more"
    if check in _COLUMNS:
        error = np.abs(np.einsum("kij,kil->kjl", *(values.reshape(-1, 3, _COLUMNS[check]),) * 2) - _EYES[check])
        if (error > _UNIT_TOLERANCE).any():
            return f" is off unit length or a right angle by {error.max():.1e}; valid: up to 1e-6"
    return None


class NumberChecks:
    """Checks of the numbers of some primitives, whose kinds stay the same."""

    def __init__(self, kinds: IntArray) -> None:
        """kinds (n,): numbers of the primitives' kinds."""
        self._parts = [
            (rows, slice(first, last), check)
            for (first, last, check), of_kinds in _OF_NUMBERS.items()
            if len(rows := np.flatnonzero(of_kinds[kinds]))
        ]

    def valid(self, numbers: FloatArray) -> bool:
        """Return whether the numbers (n, 20) are valid."""
        faults = (_fault(numbers[rows, part], check) for rows, part, check in self._parts)
        return bool(np.isfinite(numbers).all()) and all(fault is None for fault in faults)
