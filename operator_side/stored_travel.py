"""Use of what is stored for a controller, as soon as the controller is found: travel calibration, measured forces."""

from collections.abc import Callable

from common.errors import ConfigurationError
from operator_side.calibration.forces import forces_in_words, load_forces
from operator_side.calibration.store import calibration_path, load_calibration
from operator_side.controller.connection import Connection
from operator_side.core import OperatorSide
from operator_side.hands.travel_calibration import TravelCalibration


class StoredTravel:
    """Loads the stored calibration of each controller that is found, and notes which calibration is in use."""

    def __init__(self, connection: Connection, core: OperatorSide, note: Callable[[str], None]) -> None:
        self._connection, self._core, self._note = connection, core, note
        self._calibrated = 0
        self._reported: set[str] = set()

    def load(self) -> None:
        """Load the calibration of a newly found controller; call it in every turn of the loop.

        If the stored calibration is invalid: ConfigurationError for the run's first controller, a note for later ones.
        """
        controller = self._connection.controller
        if controller is None or self._calibrated == self._connection.found:
            return
        first, self._calibrated = self._calibrated == 0, self._connection.found
        if controller.address is None:
            return
        try:
            stored = load_calibration(controller.address)
        except ConfigurationError as error:
            if first:
                raise
            self._core.calibrate(TravelCalibration())
            self._reported.discard(controller.address)
            self._note(f"{error}; the controller's travel is read with the default calibration")
            return
        self._core.calibrate(stored or TravelCalibration())
        if controller.address in self._reported:
            return
        self._reported.add(controller.address)
        for text in _forces(controller.address):
            self._note(text)
        if stored is None:
            self._note(
                "the controller's travel has not been calibrated; to calibrate it: feelahead controller --calibrate"
            )
        else:
            self._note(f"the controller's calibration: {calibration_path(controller.address)}")


def _forces(address: str) -> list[str]:
    """Return a note for each trigger whose forces were measured; nothing depends on them, so a fault is a note, too."""
    try:
        forces = load_forces(address)
    except ConfigurationError as error:
        return [str(error)]
    measured = (("L2", forces.l2), ("R2", forces.r2))
    return [f"measured: {forces_in_words(name, one)}" for name, one in measured if one is not None]
