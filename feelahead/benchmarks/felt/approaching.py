"""What is felt in the end: fingers of constant force pull towards things, with the look ahead set otherwise."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from feelahead.benchmarks.felt.turning import Turned, turned
from feelahead.lab.approaches.approach import Approach, run_approach
from feelahead.lab.approaches.frozen import ASIDE, SITE, frozen_scene

SCENES: Final = ("wall", "mug", "post", "edge", "moving")
"""Straight ahead; drifting across; and towards what moves."""
FORCES_N: Final = (3.0, 2.0)
_RESTS: Final = (0.0, 0.0)


@dataclass(frozen=True)
class Approached:
    """How one approach ended."""

    how: Turned
    scene: str
    force_n: float
    end: str
    contact_speed_mm_s: float | None
    least_gap_mm: float

    @property
    def shown(self) -> str:
        """In a word or two."""
        if self.contact_speed_mm_s is not None:
            return f"hits at {self.contact_speed_mm_s:.1f}"
        return f"{self.end}, {self.least_gap_mm:.1f} mm off"


def approach_otherwise(how: Turned, scenes: Sequence[str], seed: int) -> list[Approached]:
    """Each scene with each force, in virtual time."""
    found = []
    for scene in scenes:
        across, turning = ASIDE.get(scene, (_RESTS, _RESTS))
        for force_n in FORCES_N:
            asked = Approach(frozen_scene(scene), force_n, SITE, seed=seed, stick=across, turn=turning)
            with turned(how):
                outcome = run_approach(asked)
            found.append(Approached(how, scene, force_n, outcome.end, outcome.contact_speed_mm_s, outcome.least_gap_mm))
    return found
