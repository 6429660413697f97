"""Witness of a simulation's contacts, for a recording (port `recording.true_states.Witness`)."""

from collections.abc import Mapping

from common.protocol.messages import Vector3
from common.roles import Role
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.contact_impulse import ContactImpulse
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.tick.truth import ContactOnset


class SimulationWitness:
    """Witness of one scene, whose physics `arm` advances."""

    def __init__(self, scene: Scene, arm: MujocoArm) -> None:
        self.roles: Mapping[str, Role] = scene.roles
        self._scene, self._contact, self._impulse = scene, TrueContact(scene), ContactImpulse(scene)
        arm.after_step = self._impulse.step

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
