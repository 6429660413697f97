"""Errors of the objects' perceived positions, each object its own (eq. 9-10)."""

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.enlargement.distance import Uncertainty
from robot_side.field.object_class import SKIPPED
from robot_side.surroundings.perceived import PerceivedObjects

_GROUPS: Final = 16
"""Number of groups into which objects of different errors are put at most"""


class Alike(NamedTuple):
    """Objects that are enlarged alike."""

    unseen_m: float
    variance_m2: float
    classes: IntArray
    """(k,) the objects' classes; all other objects are SKIPPED"""


def object_errors(objects: PerceivedObjects, uncertainty: Uncertainty) -> FloatArray | None:
    """Return for each object (k, 2) the distance in m by which it may have moved unseen, and its σ_c² in m².

    None if no object has moved unseen, and none has another σ_c than that of `uncertainty`.
    """
    return _object_errors(objects, uncertainty.camera_sd_m)


@lru_cache(maxsize=2)
def _object_errors(objects: PerceivedObjects, camera_sd_m: float) -> FloatArray | None:
    sds_m, late_s = objects.sds_m, objects.late_s
    if sds_m is None and objects.unseen_m == 0.0 and late_s == 0.0:
        return None
    found: FloatArray = np.empty((len(objects.names), 2))
    found[:, 0], found[:, 1] = objects.unseen_m, camera_sd_m**2
    if objects.velocities_m_s is not None and late_s > 0.0:
        found[:, 0] += late_s * np.sqrt(np.einsum("ki,ki->k", objects.velocities_m_s, objects.velocities_m_s))
    if sds_m is not None:
        known = ~np.isnan(sds_m)
        found[known, 1] = sds_m[known] ** 2
    # All looks at a frame share them.
    found.flags.writeable = False
    return found


def largest_errors(of_objects: FloatArray | None, uncertainty: Uncertainty) -> tuple[float, float]:
    """Return the unseen motion in m and the variance in m² that bound the enlargement towards every object."""
    if of_objects is None or len(of_objects) == 0:
        return 0.0, uncertainty.camera_sd_m**2
    # Below P = 0.5 a spread makes the enlargement smaller.
    variances_m2 = of_objects[:, 1]
    return float(of_objects[:, 0].max()), float(
        variances_m2.max() if uncertainty.quantile >= 0.0 else variances_m2.min()
    )


def alike(of_objects: FloatArray | None, classes: IntArray, uncertainty: Uncertainty) -> list[Alike]:
    """Return the objects in groups of the same errors. Where there are too many, the largest of a group's count.

    of_objects (k, 2) as from `object_errors`, classes (k,).
    """
    felt = np.flatnonzero(classes != SKIPPED)
    if of_objects is None or len(felt) == 0:
        return [Alike(*largest_errors(of_objects, uncertainty), classes)]
    kinds, group = np.unique(of_objects[felt], axis=0, return_inverse=True)
    if len(kinds) > _GROUPS:
        enlarged_m = kinds[:, 0] + uncertainty.quantile * np.sqrt(kinds[:, 1])
        rank = np.empty(len(kinds), dtype=np.int64)
        rank[enlarged_m.argsort(kind="stable")] = np.arange(len(kinds))
        group = (rank * _GROUPS // len(kinds))[group.ravel()]
    found = []
    for number in np.unique(group):
        mine = felt[group.ravel() == number]
        some = np.full_like(classes, SKIPPED)
        some[mine] = classes[mine]
        found.append(Alike(*largest_errors(of_objects[mine], uncertainty), some))
    return found
