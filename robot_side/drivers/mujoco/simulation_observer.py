"""Observer of a simulation's ground truth, for the figures of a run; the pipeline itself never uses it."""

from collections.abc import Mapping
from typing import Final

from common.roles import Role
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.tick.truth import ContactOnset, Truth

_NEAR_M: Final = 0.05
_FAR_S: Final = 0.04
"""Distance beyond which nothing touches the gripper before the next observation, and time until that one"""


class SimulationObserver:
    """Observer of one scene (port `outcome.figures.Observer`)."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._truth = scene, GroundTruth(scene)
        self._contact = TrueContact(scene, supports=False)
        self.roles: Mapping[str, Role] = scene.roles
        self._observed: Truth | None = None
        self._observed_s, self._near = 0.0, True

    def observe(self) -> Truth:
        """Return the true distances and contacts; while nothing is near, those of the last 40 ms will do."""
        observed, time_s = self._observed, float(self._scene.data.time)
        if observed is None or self._near or time_s - self._observed_s >= _FAR_S:
            self._observed = observed = self._truth.observe()
            self._observed_s = time_s
            self._near = observed.min_distance_m is not None and observed.min_distance_m < _NEAR_M
        return observed

    def contact(self) -> ContactOnset | None:
        """Return the contact that began since the last call, if any; until then nothing can be held."""
        return self._contact.update(None) if self._near else None
