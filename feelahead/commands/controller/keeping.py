"""Place where a measurement of one controller is kept."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from common.errors import ConfigurationError
from common.files.output_file import require_folder
from operator_side.controller.port import OpenController


@dataclass
class Keeping:
    """Place where a measurement is kept. Its faults show before the person begins, not at the end."""

    what: str
    path_of: Callable[[str], Path]
    """Path in the configuration folder, for an address"""
    out: Path | None
    """File to use instead"""
    simulated: bool
    """Whether nothing is kept without `out`"""
    address: str | None = None
    """Address of the measured controller; None before it is found"""

    @property
    def path(self) -> Path | None:
        """File of the result; None before the controller is found, and if nothing is kept."""
        if self.out is not None or self.simulated or self.address is None:
            return self.out
        return self.path_of(self.address)

    def begin(self, controller: OpenController) -> bool:
        """Take the controller to be measured; return whether it is the first one.

        ConfigurationError for one without an address, for another one, and if its result could not be kept.
        """
        if controller.address is None:
            raise ConfigurationError(f"{controller.name} does not tell its address; valid: a controller that does")
        if self.address not in (None, controller.address):
            raise ConfigurationError(f"another controller, {controller.address}; valid: the same, {self.address}")
        first, self.address = self.address is None, controller.address
        if first and self.path is not None:
            require_folder(self.what, self.path)
        return first

    def stored(self) -> str:
        """Return in words where the result is stored, and who uses it."""
        if self.path is None or self.address is None:
            return "simulated: nothing was stored (--out FILE.toml stores it)"
        own = self.path_of(self.address)
        used = "from now on" if self.path == own else f"if it is copied to {own}"
        return f"stored: {self.path}; feelahead-operator uses it {used}"
