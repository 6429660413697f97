"""Witness of a simulation's contacts, for a recording (port `recording.true_states.Witness`)."""

from collections.abc import Mapping

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import BoolArray, FloatArray
from common.protocol.messages import Vector3
from common.roles import Role
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.tick.truth import ContactOnset, is_hit


class SimulationWitness:
    """Witness of one scene, whose physics `arm` advances."""

    def __init__(self, scene: Scene, arm: MujocoArm) -> None:
        self.roles: Mapping[str, Role] = scene.roles
        self._scene, self._contact, self._impulse = scene, TrueContact(scene), _Impulse(scene)
        arm.after_step = self._impulse.step

    def own_name(self, held: str) -> str | None:
        """Return the simulation's name of a held object that is perceived by this name; None if it is not known.

        A surface has another name: then it is what the gripper touches, the target first.
        """
        if held in self.roles:
            return held
        touched = sorted(self._contact.touched, key=lambda name: (self.roles[name] is not Role.TARGET, name))
        return next((name for name in touched if self.roles[name] is not Role.SUPPORT), None)

    def touches(self, held: str | None) -> ContactOnset | None:
        """Return the fastest contact that began since the last call. held: object that the gripper holds."""
        self._impulse.look(held)
        return self._contact.update(held)

    @property
    def impulse_n_s(self) -> float:
        """Impulse of all hits so far"""
        return self._impulse.impulse_n_s

    @property
    def tool_m(self) -> Vector3:
        """True position of the tool, in the world frame"""
        x, y, z = self._scene.data.site_xpos[self._scene.robot.site].tolist()
        return x, y, z


def witness_of(scene: Scene, arm: object) -> SimulationWitness | None:
    """Return a witness of the scene; None if no simulated arm moves it."""
    return SimulationWitness(scene, arm) if isinstance(arm, MujocoArm) else None


class _Impulse:
    """Sum over time of the normal forces of hits: the gripper, or what it holds, on what they should not touch.

    `step` is to be called after each step of the physics.
    """

    def __init__(self, scene: Scene) -> None:
        self.impulse_n_s = 0.0
        self._scene = scene
        self._model, self._data = scene.model, scene.data
        self._step_s = float(scene.model.opt.timestep)
        self._force: FloatArray = np.zeros(6)
        self._of: tuple[str | None, tuple[Role, ...]] | None = None
        self._pairs: BoolArray = np.zeros((0, 0), dtype=np.bool_)
        """(g, g) whether a contact of two geoms is a hit"""
        self.look(None)

    def look(self, held: str | None) -> None:
        """Take the roles as they are now, and the object that the gripper holds."""
        scene, of = self._scene, (held, tuple(self._scene.roles.values()))
        if of == self._of:
            return
        self._of, count = of, self._model.ngeom
        ours = dict.fromkeys(map(int, scene.robot.gripper_geoms), False)
        ours |= {geom: True for thing in scene.objects if thing.name == held for geom in thing.geoms}
        pairs = np.zeros((count, count), dtype=np.bool_)
        for thing in scene.objects:
            for mine, by_held in ours.items():
                if thing.name != held and is_hit(scene.roles[thing.name], by_held=by_held):
                    pairs[mine, list(thing.geoms)] = True
        self._pairs = pairs | pairs.T

    def step(self) -> None:
        """Add the impulse of the newest step."""
        if self._data.ncon == 0:
            return
        first, second = self._data.contact.geom.T
        for row in np.flatnonzero(self._pairs[first, second]):
            mujoco.mj_contactForce(self._model, self._data, row, self._force)
            self.impulse_n_s += float(self._force[0]) * self._step_s
