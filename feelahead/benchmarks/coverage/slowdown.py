"""What a law costs: the time to a goal in the free, over that without haptics, for the same hand and seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from statistics import median

from feelahead.approaches.approach import Approach, time_to_goal_s
from feelahead.approaches.frozen import frozen_scene
from feelahead.approaches.laws import Law
from feelahead.approaches.pulls import make_pull
from feelahead.benchmarks.coverage.cells import LINKS

SCENES = ("empty", "cluttered")
GOAL_M = 0.25
_LIMIT_S = 15.0
_LINK = "200 ms"
_MARGIN_M = 0.045
"""The fixed margin's enlargement: the first law's mean at 200 ms each way (the table of coverage prints it)."""


@dataclass(frozen=True)
class Slowdown:
    """One law in one scene."""

    scene: str
    law: Law
    ratio: float | None
    """The median over the seeds of time over time without haptics; None where most never arrive."""
    arrived: int
    seeds: int


def race(scene: str, law: Law, seeds: Sequence[int]) -> Slowdown:
    """The ratio over hands that pull in bells and steadily."""
    ratios = []
    for seed in seeds:
        free_s, felt_s = _time_s(scene, "none", seed), _time_s(scene, law, seed)
        if free_s is not None:
            ratios.append(felt_s / free_s if felt_s is not None else float("inf"))
    arrived = sum(ratio < float("inf") for ratio in ratios)
    middle = median(ratios) if ratios else float("inf")
    return Slowdown(scene, law, middle if middle < float("inf") else None, arrived, len(ratios))


@cache
def _time_s(scene: str, law: Law, seed: int) -> float | None:
    approach = Approach(
        model=frozen_scene(scene),
        force_n=0.0,
        link=LINKS[_LINK],
        law=law,
        duration_s=_LIMIT_S,
        seed=seed,
        margin_m=_MARGIN_M,
    )
    return time_to_goal_s(approach, make_pull("bell" if seed % 2 else "steady", seed), GOAL_M)
