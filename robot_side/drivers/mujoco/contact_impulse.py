"""Impulse of the gripper, and of what it holds, on what they should not touch; only for experiments."""

from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from robot_side.drivers.mujoco.scene import Scene
from robot_side.tick.truth import is_hit


class ContactImpulse:
    """Sum over time of the normal forces of hits. `step` is to be called after each step of the physics."""

    def __init__(self, scene: Scene) -> None:
        self.impulse_n_s = 0.0
        self.held: str | None = None
        """Object that the gripper holds"""
        self._scene = scene
        self._model, self._data = scene.model, scene.data
        self._object_of = {geom: thing.name for thing in scene.objects for geom in thing.geoms}
        self._gripper = np.zeros(scene.model.ngeom, dtype=bool)
        self._gripper[scene.robot.gripper_geoms] = True
        self._carried = {thing.name: frozenset(thing.geoms) for thing in scene.objects}
        self._force: FloatArray = np.zeros(6)

    def step(self) -> None:
        """Add the impulse of the newest step."""
        if self._data.ncon == 0:
            return
        contacts, held = self._data.contact, self._carried.get(self.held or "", frozenset())
        ours = self._gripper[contacts.geom].any(axis=1)
        if held:
            ours |= np.isin(contacts.geom, list(held)).any(axis=1)
        for row in np.flatnonzero(ours):
            if self._hits(contacts.geom[row], held):
                mujoco.mj_contactForce(self._model, self._data, row, self._force)
                self.impulse_n_s += float(self._force[0]) * float(self._model.opt.timestep)

    def _hits(self, pair: Any, held: frozenset[int]) -> bool:
        for mine, theirs in ((int(pair[0]), int(pair[1])), (int(pair[1]), int(pair[0]))):
            thing, by_held = self._object_of.get(theirs), mine in held
            if thing is not None and theirs not in held and (by_held or self._gripper[mine]):
                return is_hit(self._scene.roles[thing], by_held=by_held)
        return False
