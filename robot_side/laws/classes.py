"""Classes of the objects by their roles and by what is held: how a look treats each of them."""

from dataclasses import dataclass

import numpy as np

from common.arrays import IntArray
from common.roles import Role
from robot_side.field.object_class import OBSTACLE, SKIPPED, TARGET, TOUCHABLE
from robot_side.surroundings.perceived import PerceivedObjects


@dataclass(frozen=True, eq=False)
class Classes:
    """Classes of the objects (k,) for given roles and held object."""

    roles: object
    held: int | None
    meant: object
    """Held object, and roles. Those of a map's surfaces come and go with them: of these the targets alone"""
    usual: IntArray
    closing: IntArray
    """Classes while the fingers move: the target is SKIPPED, because the fingers shall touch it"""

    def fit(self, objects: PerceivedObjects, held: int | None) -> bool:
        """Return whether roles and held object are still the same."""
        return self.held == held and (self.roles is objects.roles or self.roles == objects.roles)


def classes_of(objects: PerceivedObjects, held: int | None) -> Classes:
    """Return the classes of a frame's objects. held: index of the held object, if any."""
    of_role = {Role.TARGET: TARGET, Role.IGNORED: SKIPPED, Role.SUPPORT: OBSTACLE if held is None else TOUCHABLE}
    # Roles are hashed slowly, and there may be thousands.
    of_id = {id(role): of_role.get(role, OBSTACLE) for role in Role}
    usual = np.fromiter(map(of_id.__getitem__, map(id, objects.roles)), np.int64, len(objects.roles))
    if held is not None:
        usual[held] = SKIPPED
    meant = objects.roles if objects.surfaces is None else tuple(np.flatnonzero(usual == TARGET).tolist())
    return Classes(objects.roles, held, (held, meant), usual, np.where(usual == TARGET, SKIPPED, usual))
