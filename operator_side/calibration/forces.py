"""Forces of a controller's triggers, measured with a kitchen scale, and their storage beside the travel calibration.

controllers/aa-bb-cc-dd-ee-ff.forces.toml
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from operator_side.calibration.controller_file import controller_file, read_controller_file, write_controller_file
from operator_side.controller.feel import MAX_STRENGTH

STRENGTHS: Final = MAX_STRENGTH + 1
"""Number of measured strengths: 0, the spring alone, to 8"""
LARGEST_N: Final = 50.0
_MEND: Final = "measure it again with: feelahead controller --measure-forces; or delete the file"


@dataclass(frozen=True)
class TriggerForces:
    """Forces, in newtons, at which one trigger yielded at one place of its travel, spring included."""

    pulls_n: tuple[float, ...]
    """Force for each strength, 0 to 8."""

    def __post_init__(self) -> None:
        if len(self.pulls_n) != STRENGTHS or not all(0.0 < pull_n <= LARGEST_N for pull_n in self.pulls_n):
            raise ValueError(f"pulls_n = {list(self.pulls_n)}; valid: {STRENGTHS} numbers above 0, at most {LARGEST_N}")

    def added_n(self, strength: int) -> float:
        """Return the force that `strength`, 0 to 8, adds to the spring's; below 0 if it was measured so."""
        return self.pulls_n[strength] - self.pulls_n[0]

    def least_noticed(self, share: float) -> int | None:
        """Return the least strength from which on each one adds `share` of the spring's force; None without one."""
        noticed = [self.added_n(strength) >= share * self.pulls_n[0] for strength in range(STRENGTHS)]
        least = STRENGTHS - next((n for n, yes in enumerate(reversed(noticed)) if not yes), STRENGTHS)
        return least if least < STRENGTHS else None


@dataclass(frozen=True)
class ControllerForces:
    """Measured forces of one controller; None for a trigger that was not measured."""

    l2: TriggerForces | None = None
    r2: TriggerForces | None = None


@dataclass(frozen=True)
class _Stored:
    """Content of a file of forces."""

    version: Literal[1]
    address: str
    l2: TriggerForces | None = None
    r2: TriggerForces | None = None


def forces_path(address: str) -> Path:
    """Return the path of the forces of the controller with the address "aa:bb:cc:dd:ee:ff"; else ValueError."""
    return controller_file(address, ".forces.toml")


def load_forces(address: str) -> ControllerForces:
    """Load the forces of the controller with this address; nothing is measured without a file.

    ConfigurationError, in one line with the remedy, if the file is invalid or of another controller.
    """
    return stored_forces(forces_path(address), address)


def stored_forces(path: Path, address: str) -> ControllerForces:
    """Return the content of the file `path`, or nothing measured without a file; errors as in `load_forces`."""
    if not path.exists():
        return ControllerForces()
    stored, _ = read_controller_file(path, _Stored, _MEND, address)
    return ControllerForces(stored.l2, stored.r2)


def write_forces(path: Path, address: str, forces: ControllerForces) -> None:
    """Write the file atomically, and make the folder of controllers if needed; ConfigurationError if that fails."""
    lines = []
    for name, trigger in (("l2", forces.l2), ("r2", forces.r2)):
        if trigger is not None:
            lines += ["", f"[{name}]", f"pulls_n = {[round(pull_n, 3) for pull_n in trigger.pulls_n]}"]
    made_by = (
        "Forces at which one controller's triggers yielded, in newtons. Made by: feelahead controller --measure-forces"
    )
    write_controller_file(path, "forces", address, made_by, lines)


def forces_in_words(name: str, forces: TriggerForces) -> str:
    """Return one line: the spring's force of the trigger `name`, and what each strength adds."""
    added = " ".join(f"{forces.added_n(strength):.1f}" for strength in range(1, STRENGTHS))
    return f"{name} yields to {forces.pulls_n[0]:.1f} N without an effect; strengths 1 to 8 add {added} N"
