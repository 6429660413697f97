"""Observer of a simulation's ground truth, for the figures of a run; the pipeline itself never uses it."""

from collections.abc import Mapping

from common.roles import Role
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.tick.truth import ContactOnset, Truth


class SimulationObserver:
    """Observer of one scene (port `outcome.figures.Observer`)."""

    def __init__(self, scene: Scene) -> None:
        self._truth = GroundTruth(scene)
        self._contact = TrueContact(scene, supports=False)
        self.roles: Mapping[str, Role] = scene.roles

    def observe(self) -> Truth:
        """Return the true distances and contacts."""
        return self._truth.observe()

    def contact(self) -> ContactOnset | None:
        """Return the contact that began since the last call, if any; until then nothing can be held."""
        return self._contact.update(None)
