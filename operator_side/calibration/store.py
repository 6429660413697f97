"""Storage of each controller's travel calibration."""

import dataclasses
from pathlib import Path
from typing import Any, Final, Literal

from common.errors import ConfigurationError
from operator_side.calibration.controller_file import controller_file, read_controller_file, write_controller_file
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel

_MEND: Final = "to measure again: feelahead controller --calibrate; to use the defaults: delete the file"


@dataclasses.dataclass(frozen=True)
class _Stored:
    """Content of a calibration file."""

    version: Literal[1]
    address: str
    l2: TriggerTravel
    r2: TriggerTravel
    left_stick: StickRest
    right_stick: StickRest


def calibration_path(address: str) -> Path:
    """Return the path of the calibration of the controller with this address, "aa:bb:cc:dd:ee:ff"; else ValueError."""
    return controller_file(address)


def load_calibration(address: str) -> TravelCalibration | None:
    """Load the calibration of the controller with the address "aa:bb:cc:dd:ee:ff"; None without a file.

    ConfigurationError, in one line with the remedy, if the file is invalid or of another controller.
    """
    path = calibration_path(address)
    try:
        path.stat()
    except FileNotFoundError:
        return None
    except OSError:
        pass  # reading reports the fault
    return read_calibration(path, address)[1]


def read_calibration(path: Path, address: str | None = None) -> tuple[str, TravelCalibration]:
    """Read address and calibration from the file `path`; errors as in `load_calibration`. address: as it must be."""
    stored, content = read_controller_file(path, _Stored, _MEND, address)
    known: dict[str, Any] = dataclasses.asdict(stored)
    for part in ("", "l2", "r2", "left_stick", "right_stick"):
        wanted, found = (known, content) if not part else (known[part], content[part])
        for key in sorted(wanted.keys() ^ found.keys()):
            what = "is missing" if key in wanted else "is unknown"
            valid = f"valid keys: {', '.join(sorted(wanted))}"
            raise ConfigurationError(f"{path}: {part and f'{part}.'}{key[:80]} {what}; {valid}; {_MEND}")
    return stored.address, TravelCalibration(stored.l2, stored.r2, stored.left_stick, stored.right_stick)


def write_calibration(path: Path, address: str, calibration: TravelCalibration) -> None:
    """Write the file atomically, and make its folder if needed; ConfigurationError if that fails."""
    lines = []
    for part, values in dataclasses.asdict(calibration).items():
        lines += ["", f"[{part}]", *(f"{key} = {value!r}" for key, value in values.items())]
    made_by = (
        "Travel of one controller's triggers and sticks, as it reports it. Made by: feelahead controller --calibrate"
    )
    write_controller_file(path, "calibration", address, made_by, lines)
