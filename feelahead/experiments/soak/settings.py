"""What one may ask a soak for."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from common.emulation.spec import LinkSpec
from robot_side.operators.lease import MOST_OBSERVERS

_MOST_PROCESSES = 2
"""Each takes a tenth of a core of the two, of which robot side and owner take one together."""


@dataclass(frozen=True)
class SoakSettings:
    """Run both sides for a while, and tell whether memory and descriptors stay flat."""

    minutes: Annotated[float, tyro.conf.arg(metavar="N")] = 2.0
    """How long, in the time of the run."""
    virtual: bool = False
    """In virtual time, in one process."""
    observers: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """How many others watch: two as processes, the rest from within this one."""
    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = "delay 20ms 5ms"
    """Emulated link, in netem's words."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """For every random draw."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        LinkSpec.parse(self.link, 0)
        if not 0.0 < self.minutes <= 1440.0:
            raise ValueError(f"--minutes {self.minutes}: valid: above 0 to 1440")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or a larger whole number")
        if not 0 <= self.observers <= MOST_OBSERVERS:
            raise ValueError(f"--observers {self.observers}: valid: 0 to {MOST_OBSERVERS}")
        if self.observers and self.virtual:
            raise ValueError(f"--observers {self.observers} with --virtual: valid: one of them")

    @property
    def observing_processes(self) -> int:
        """How many observers have a process of their own."""
        return min(self.observers, _MOST_PROCESSES)

    @property
    def light(self) -> int:
        """How many observers have none."""
        return self.observers - self.observing_processes
