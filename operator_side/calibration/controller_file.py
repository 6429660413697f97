"""TOML files that belong to one controller, in the user's configuration folder.

    controllers/aa-bb-cc-dd-ee-ff.toml      named by the controller's address, the same on USB and Bluetooth

The names have dashes, because Windows allows no colons in names.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from common.errors import ConfigurationError
from common.files.output_file import output_file
from common.files.toml_complaint import explain
from common.files.toml_file import read_toml
from common.files.user_folders import configuration_folder
from operator_side.controller.port import checked_address

_LARGEST_BYTES: Final = 10_000
_Stored = TypeVar("_Stored")


def controller_file(address: str, ending: str = ".toml") -> Path:
    """Return the path of a file of the controller with this address; ValueError unless like "aa:bb:cc:dd:ee:ff"."""
    return configuration_folder() / "controllers" / (checked_address(address).replace(":", "-") + ending)


def read_controller_file(
    path: Path, kind: type[_Stored], mend: str, address: str | None = None
) -> tuple[_Stored, dict[str, Any]]:
    """Read a file as a `kind`, which has a field `address`, and as its plain content.

    address: the file must be of this controller. ConfigurationError, in one line that ends with `mend`, if it is not,
    or is invalid.
    """
    try:
        content = read_toml(path, _LARGEST_BYTES)
        try:
            stored: Any = msgspec.convert(content, kind)
        except msgspec.ValidationError as error:
            raise ValueError(explain(str(error), content, kind)) from error
        if stored.address != (address or checked_address(stored.address)):
            raise ValueError(f"address = {stored.address[:80]!r}; valid: {address}, the controller that it belongs to")
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:  # of the file, of TOML and of the values themselves
        raise ConfigurationError(f"{path}: {error}; {mend}") from error
    return stored, content


def write_controller_file(path: Path, what: str, address: str, made_by: str, lines: Iterable[str]) -> None:
    """Write the file completely or not at all, and make its folder if needed; ConfigurationError if that fails."""
    if configuration_folder() in path.absolute().parents:
        path.parent.mkdir(parents=True, exist_ok=True)
    head = [f"# {made_by}", "version = 1", f'address = "{checked_address(address)}"']
    with output_file(what, path) as file:
        file.write("\n".join([*head, *lines]) + "\n")
