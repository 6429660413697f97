"""What `feelahead bench coverage` is told."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro

from common.files.output_file import require_output_file
from feelahead.benchmarks.coverage.cells import Plan, full_plan, quick_plan
from feelahead.lab.approaches.laws import LAWS, Law
from feelahead.lab.approaches.spoilt import Spoil
from feelahead.lab.figures import PICTURES

_GREATEST = 0.9999
"""That takes 100 000 draws a cell."""


@dataclass(frozen=True)
class CoverageSettings:
    """How often full stiffness stands in time, and how often it stands without need, for each law.

    Covered: 0.25 s before the last moment at which letting go avoids the contact, full strength stood in the zone that
    the finger reaches until then. False alarm: strength of 4 or more under the finger, while that zone's stopping path
    from the true pose stays D_σ(P) + 15 mm clear. Slowdown: the time to a goal in the free over that without haptics.
    Pulls are recorded open loop over the emulated link, and judged for every scene, camera draw, law and P.
    """

    quick: bool = False
    """A few cells in three minutes, instead of all in two hours."""
    laws: tuple[Law, ...] = LAWS
    """Set side by side."""
    probabilities: Annotated[tuple[float, ...], tyro.conf.arg(metavar="P...")] = ()
    """Only these P, instead of the plan's own; n >= 10/(1 - P) draws a cell each."""
    checked: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """So many approaches again in full physics, closed loop, instead of the plan's own."""
    raced: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Seeds for the time to a goal, instead of the plan's own; 0 leaves it out."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """For every draw: the same seed gives the same figures."""
    workers: Annotated[int, tyro.conf.arg(metavar="N")] = 2
    """Processes at the same time."""
    resume: Annotated[Path | None, tyro.conf.arg(metavar="FILE.jsonl")] = None
    """Write each motion's figures there as soon as it is done, and leave out what is there already."""
    only: Annotated[tuple[str, ...], tyro.conf.arg(metavar="TEXT...")] = ()
    """Only cells whose name contains one of these, as in 'wall/bell/200 ms'."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE.csv")] = None
    """Write every cell's figures there."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Draw coverage against false alarms."""
    spoil: Spoil = "nothing"
    """Spoil the laws on purpose, to see that the figures notice: 100 ms late, or on the other trigger."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        for name, lowest in (("seed", 0), ("workers", 1)):
            if getattr(self, name) < lowest:
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {lowest} or more")
        if not self.laws:
            raise ValueError(f"--laws: valid: one or more of {', '.join(LAWS)}")
        for probability in self.probabilities:
            if not 0.0 < probability <= _GREATEST:
                raise ValueError(f"--probabilities {probability}: valid: above 0 up to {_GREATEST}")
        for name in ("checked", "raced"):
            if (count := getattr(self, name)) is not None and count < 0:
                raise ValueError(f"--{name} {count}: valid: 0 or more")
        if len(set(self.laws)) < len(self.laws):
            raise ValueError(f"--laws {' '.join(self.laws)}: valid: each law once")
        require_output_file("--resume", self.resume)
        require_output_file("--csv", self.csv)
        require_output_file("--picture", self.picture, PICTURES)
        if not self.plan().cells:
            raise ValueError(f"--only {' '.join(self.only)}: no cell's name contains it; valid: as wall/bell/200 ms")

    def plan(self) -> Plan:
        """What is to be done."""
        whole = quick_plan(self.laws) if self.quick else full_plan(self.laws)
        return replace(
            whole,
            cells=tuple(cell for cell in whole.cells if not self.only or any(text in cell.key for text in self.only)),
            probabilities=tuple(sorted(set(self.probabilities))) or whole.probabilities,
            checked=whole.checked if self.checked is None else self.checked,
            raced=whole.raced if self.raced is None else self.raced,
        )
