"""Storage of each controller's travel calibration, in a TOML file in the user's configuration folder.

    controllers/aa-bb-cc-dd-ee-ff.toml      named by the controller's address, the same on USB and Bluetooth

The file's name has dashes, because Windows allows no colons in names.
"""

import dataclasses
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from common.errors import ConfigurationError
from common.files.output_file import output_file
from common.files.toml_complaint import explain
from common.files.toml_file import read_toml
from common.files.user_folders import configuration_folder
from operator_side.controller.port import checked_address
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel

_LARGEST_BYTES: Final = 10_000
_MEND: Final = "measure it again with: feelahead calibrate; or delete the file for the defaults"


@dataclasses.dataclass(frozen=True)
class _Stored:
    """Content of a calibration file."""

    version: Literal[1]
    address: str
    l2: TriggerTravel
    r2: TriggerTravel
    left_stick: StickRest
    right_stick: StickRest

    def __post_init__(self) -> None:
        checked_address(self.address)


def calibration_path(address: str) -> Path:
    """Return the path of the calibration file of the controller with this address.

    ValueError unless `address` has the form "aa:bb:cc:dd:ee:ff".
    """
    return configuration_folder() / "controllers" / f"{checked_address(address).replace(':', '-')}.toml"


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
    stored, calibration = read_calibration(path)
    if stored != address:
        raise ConfigurationError(f"{path}: belongs to the controller {stored}; valid: {address}; {_MEND}")
    return calibration


def read_calibration(path: Path) -> tuple[str, TravelCalibration]:
    """Read address and calibration from the file `path`; ConfigurationError, in one line, if it is invalid."""
    try:
        return _read(read_toml(path, _LARGEST_BYTES))
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:  # of the file, of TOML and of the values themselves
        raise ConfigurationError(f"{path}: {error}; {_MEND}") from error


def write_calibration(path: Path, address: str, calibration: TravelCalibration) -> None:
    """Write the file atomically, and make its folder if needed; ConfigurationError if that fails."""
    if configuration_folder() in path.absolute().parents:
        path.parent.mkdir(parents=True, exist_ok=True)
    with output_file("calibration", path) as file:
        file.write(_text(address, calibration))


def _text(address: str, calibration: TravelCalibration) -> str:
    lines = [
        "# Travel of one controller's triggers and sticks, as its reports have it. Made by: feelahead calibrate",
        "version = 1",
        f'address = "{address}"',
    ]
    for part, values in dataclasses.asdict(calibration).items():
        lines += ["", f"[{part}]", *(f"{key} = {value!r}" for key, value in values.items())]
    return "\n".join(lines) + "\n"


def _read(content: dict[str, Any]) -> tuple[str, TravelCalibration]:
    """Convert the file's content; ValueError, which names the key, if it is invalid."""
    try:
        stored = msgspec.convert(content, _Stored)
    except msgspec.ValidationError as error:
        raise ValueError(explain(str(error), content, _Stored)) from error
    known = dataclasses.asdict(stored)
    for part in ("", "l2", "r2", "left_stick", "right_stick"):
        wanted, found = (known, content) if not part else (known[part], content[part])
        for key in sorted(wanted.keys() ^ found.keys()):
            what = "is missing" if key in wanted else "is unknown"
            raise ValueError(f"{part and f'{part}.'}{key[:80]} {what}; valid keys: {', '.join(sorted(wanted))}")
    return stored.address, TravelCalibration(stored.l2, stored.r2, stored.left_stick, stored.right_stick)
