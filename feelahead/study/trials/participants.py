"""Simulated participants: how persons differ, learn and lapse. All figures are assumptions, with their sources.

- Reaction to what is seen: 231 ms in the mean of 1469 persons (Woods et al. 2015, simple reactions to a screen).
- Learning: each person's error falls exponentially with the trials (Heathcote, Brown and Mewhort 2000).
- Lapses: 0 to 5 % of trials, as psychophysics assumes (Wichmann and Hill 2001). One who lapses takes no notice of what
  they feel.
The rest has no source: how far persons misjudge depth, how much of it they learn, how many believe a stiff trigger.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from feelahead.both_sides.grasping_trial import MISJUDGES_DEPTH
from operator_side.people.settings import PersonSettings

_REACTION_S: Final = (0.231, 0.03)
"""Mean over persons, and their standard deviation"""
_TOUCH_REACTION_S: Final = (0.30, 0.04)
_BIAS_M: Final = (0.010, 0.010)
"""Mean error of judged depth without practice"""
_SPREAD_M: Final = (0.030, 0.3)
"""Median over persons of the spread of judged depth, and its standard deviation as a logarithm"""
_LEARNT: Final = 0.4
"""Share of the error of judged depth that practice takes away in the end"""
_LEARNS_TRIALS: Final = 15.0
"""Number of trials in which 63 % of it is gone"""
_TRUST: Final = (8.0, 2.0)
"""Parameters of the beta distribution of the share of cues that a person believes"""
_MOST_LAPSES: Final = 0.05
_LOAD: Final = (45.0, 15.0)
"""Mean of a person's answers to what a task demands, of 100, and the persons' standard deviation"""
_PER_HIT: Final = 20.0
"""What a hit in each trial adds to an answer"""
_ANSWER_SD: Final = 8.0


@dataclass(frozen=True)
class Participant:
    """Abilities of one simulated participant."""

    person: PersonSettings
    """Before any practice"""
    lapses: float
    """Share of trials in which they take no notice of what they feel"""
    load: float
    """Usual answer to what a task demands, of 100"""

    @classmethod
    def drawn(cls, seed: int, number: int) -> "Participant":
        """Draw the participant with this number of the study with this seed."""
        draw = np.random.default_rng([seed, number, 0xBE])
        person = replace(
            MISJUDGES_DEPTH,
            visual_reaction_s=max(float(draw.normal(*_REACTION_S)), 0.12),
            touch_reaction_s=max(float(draw.normal(*_TOUCH_REACTION_S)), 0.15),
            depth_error_mean_m=float(draw.normal(*_BIAS_M)),
            depth_error_sd_m=_SPREAD_M[0] * math.exp(float(draw.normal(0.0, _SPREAD_M[1]))),
            trust=float(draw.beta(*_TRUST)),
        )
        return cls(person, float(draw.uniform(0.0, _MOST_LAPSES)), float(draw.normal(*_LOAD)))

    def at(self, practised: int, seed: int) -> PersonSettings:
        """Return the person after so many trials, in the trial with this seed, which decides whether they lapse."""
        left = 1.0 - _LEARNT * (1.0 - math.exp(-practised / _LEARNS_TRIALS))
        lapses = np.random.default_rng([seed, 0x1A]).random() < self.lapses
        return replace(
            self.person,
            depth_error_mean_m=left * self.person.depth_error_mean_m,
            depth_error_sd_m=left * self.person.depth_error_sd_m,
            trust=0.0 if lapses else self.person.trust,
        )

    def answer(self, low: float, high: float, hits: float, seed: list[int]) -> float:
        """Return an answer on a scale that asks for a load, after a block with so many hits a trial."""
        load = self.load + _PER_HIT * hits + float(np.random.default_rng(seed).normal(0.0, _ANSWER_SD))
        return low + (high - low) * min(max(load / 100.0, 0.0), 1.0)
