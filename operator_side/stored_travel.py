"""The travel calibration that is stored for a controller, taken on as soon as it is found."""

from collections.abc import Callable

from common.errors import ConfigurationError
from operator_side.calibration.store import calibration_path, load_calibration
from operator_side.controller.connection import Connection
from operator_side.core import OperatorSide
from operator_side.hands.travel_calibration import TravelCalibration


class StoredTravel:
    """Looks once for each time that a controller is found, and says which calibration it goes by."""

    def __init__(self, connection: Connection, core: OperatorSide, note: Callable[[str], None]) -> None:
        self._connection, self._core, self._note = connection, core, note
        self._calibrated = 0
        self._told: set[str] = set()

    def follow(self) -> None:
        """In every turn.

        ConfigurationError when the run's first controller has a stored calibration that is broken; later it is only
        said.
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
            self._told.discard(controller.address)
            self._note(f"{error}; its travel is read by the defaults")
            return
        self._core.calibrate(stored or TravelCalibration())
        if controller.address in self._told:
            return
        self._told.add(controller.address)
        if stored is None:
            self._note("its travel has not been calibrated: feelahead calibrate does that")
        else:
            self._note(f"its travel calibration: {calibration_path(controller.address)}")
