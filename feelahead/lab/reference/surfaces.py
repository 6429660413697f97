"""Surfaces by their definition: the pieces of one surface are the primitives of one object."""

from dataclasses import replace

import numpy as np

from common.arrays import IntArray
from robot_side.field.along import Along
from robot_side.field.object_class import SKIPPED
from robot_side.surroundings.perceived import KINDS, PerceivedObjects


def whole_surfaces(objects: PerceivedObjects, classes: IntArray, along: Along) -> tuple[PerceivedObjects, Along]:
    """Return a frame in which the first piece of each surface has all pieces' primitives, and their largest errors.

    classes (k,): the objects', one for all pieces of a surface.
    """
    if objects.surfaces is None:
        return objects, along
    numbers = np.where(classes != SKIPPED, objects.surfaces, -1)
    owners = np.arange(len(classes))
    approach_m = None if along.approach_m is None else along.approach_m.copy()
    of_objects = None if along.of_objects is None else along.of_objects.copy()
    for number in np.unique(numbers[numbers >= 0]):
        pieces = np.flatnonzero(numbers == number)
        owners[pieces] = first = pieces[0]
        if approach_m is not None:
            approach_m[first] = approach_m[pieces].max()
        if of_objects is not None:
            unseen_m, variances_m2 = of_objects[pieces].T
            of_objects[first] = unseen_m.max(), variances_m2.max() if along.quantile >= 0.0 else variances_m2.min()
    owned = {kind.owner: owners[getattr(objects, kind.owner)] for kind in KINDS}
    return replace(objects, surfaces=None, **owned), replace(along, approach_m=approach_m, of_objects=of_objects)
