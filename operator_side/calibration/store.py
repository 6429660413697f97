"""Each controller's travel calibration as a TOML file that people can read, in their configuration folder.

    controllers/aa-bb-cc-dd-ee-ff.toml      by the controller's own address, the same on USB and Bluetooth

The address is written with dashes in the file's name, because colons are not allowed there on Windows.
"""

import dataclasses
import math
import os
import reprlib
import tempfile
from pathlib import Path
from typing import Any, Final

from common.errors import ConfigurationError
from common.files.toml_file import read_toml
from common.files.user_folders import configuration_folder
from operator_side.dualsense.reports.feature_report import checked_address
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel

_VERSION: Final = 1
_PARTS: Final[dict[str, type[TriggerTravel] | type[StickRest]]] = {
    "l2": TriggerTravel,
    "r2": TriggerTravel,
    "left_stick": StickRest,
    "right_stick": StickRest,
}
_LARGEST_BYTES: Final = 10_000
_MEND: Final = "measure it anew with: feelahead calibrate; or delete the file for the defaults"


def calibration_path(address: str) -> Path:
    """Where the calibration of the controller `address` ("aa:bb:cc:dd:ee:ff") is; ValueError for another form."""
    return configuration_folder() / "controllers" / f"{checked_address(address).replace(':', '-')}.toml"


def load_calibration(address: str) -> TravelCalibration | None:
    """The stored calibration of the controller `address` ("aa:bb:cc:dd:ee:ff"); None when there is none.

    ConfigurationError, in one line with what mends it, for a file that is broken or another controller's.
    """
    path = calibration_path(address)
    try:
        path.stat()
    except FileNotFoundError:
        return None
    except OSError:
        pass  # reading says what is wrong
    stored, calibration = read_calibration(path)
    if stored != address:
        raise ConfigurationError(f"{path}: is of the controller {stored}; valid: {address}; {_MEND}")
    return calibration


def read_calibration(path: Path) -> tuple[str, TravelCalibration]:
    """Address and calibration in the file `path`; ConfigurationError, in one line, when it is broken."""
    try:
        return _read(read_toml(path, _LARGEST_BYTES))
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:  # of the file, of TOML and of the values themselves
        raise ConfigurationError(f"{path}: {error}; {_MEND}") from error


def place_to_write(path: Path, named: str = "") -> Path:
    """The file that `write_calibration(path, ...)` makes or replaces: `path`, or the file that a link there leads to.

    ConfigurationError, with the path as `named`, where something else stands (a folder, a device, a pipe, a link to
    nothing), or where the folder is missing: only our own are made.
    """
    named = named or str(path)
    try:
        target = path.resolve() if path.is_symlink() else path
        if target.is_dir():
            raise ConfigurationError(f"{named}: is a folder; valid: a file's path")
        if target.exists():
            if not target.is_file():
                raise ConfigurationError(f"{named}: is no regular file; valid: a file's path")
        elif target != path:
            raise ConfigurationError(f"{named}: is a link to {target}, which is missing; valid: a file's path")
        elif not (_is_ours(path) or path.absolute().parent.is_dir()):
            raise ConfigurationError(f"{named}: there is no folder {path.absolute().parent}")
    except (OSError, RuntimeError) as error:  # RuntimeError: links that lead to each other
        why = error.strerror if isinstance(error, OSError) else "a link that leads to itself"
        raise ConfigurationError(f"{named}: cannot be written: {why}") from error
    return target


def _is_ours(path: Path) -> bool:
    return configuration_folder() in path.absolute().parents


def write_calibration(path: Path, address: str, calibration: TravelCalibration) -> None:
    """Write the file whole or not at all; a link stays, and what it leads to is written.

    Our own configuration folders are made. OSError names what the system does not let us at, ConfigurationError says
    what stands in the way (see `place_to_write`).
    """
    if _is_ours(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    path = place_to_write(path)
    descriptor, draft = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(_text(address, calibration))
            file.flush()
            os.fsync(file.fileno())
        Path(draft).chmod(0o644)
        Path(draft).replace(path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise


def _text(address: str, calibration: TravelCalibration) -> str:
    lines = [
        "# Travel of one controller's triggers and sticks, as its reports have it. Made by: feelahead calibrate",
        f"version = {_VERSION}",
        f'address = "{address}"',
    ]
    for part in _PARTS:
        lines += ["", f"[{part}]"]
        lines += [f"{key} = {value!r}" for key, value in dataclasses.asdict(getattr(calibration, part)).items()]
    return "\n".join(lines) + "\n"


def _read(content: dict[str, Any]) -> tuple[str, TravelCalibration]:
    """ValueError names the key."""
    _require_keys(content, {"version", "address", *_PARTS}, "")
    if isinstance(content["version"], bool) or content["version"] != _VERSION:
        raise ValueError(f"version = {reprlib.repr(content['version'])}; valid: {_VERSION}")
    address = checked_address(content["address"])
    parts: dict[str, Any] = {}
    for part, kind in _PARTS.items():
        values = content[part]
        if not isinstance(values, dict):
            raise ValueError(f"{part} = {reprlib.repr(values)}; valid: a table")
        _require_keys(values, {field.name for field in dataclasses.fields(kind)}, f"{part}.")
        for key, value in values.items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise ValueError(f"{part}.{key} = {reprlib.repr(value)}; valid: a finite number")
        try:
            parts[part] = kind(**{key: float(value) for key, value in values.items()})
        except ValueError as error:
            raise ValueError(f"{part}: {error}") from error
    return address, TravelCalibration(**parts)


def _require_keys(content: dict[str, Any], wanted: set[str], prefix: str) -> None:
    for key in sorted(content.keys() ^ wanted):
        what = "is missing" if key in wanted else "is unknown"
        raise ValueError(f"{prefix}{key[:80]} {what}; valid keys: {', '.join(sorted(wanted))}")
