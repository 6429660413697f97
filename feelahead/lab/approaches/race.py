"""Measure how much a law slows down: time to a goal in free space, divided by the time without haptics."""

from collections.abc import Sequence
from functools import cache
from statistics import median
from typing import Final

from feelahead.lab.approaches.approach import Approach, PullRun
from feelahead.lab.approaches.evaluation import LINKS
from feelahead.lab.approaches.frozen import frozen_scene
from feelahead.lab.approaches.laws import Law
from feelahead.lab.approaches.pulls import make_pull
from feelahead.lab.table import Row

RACED: Final = ("empty", "cluttered")
"""Scenes with a free way to the goal."""
_GOAL_M: Final = 0.25
_LIMIT_S: Final = 15.0
_LINK: Final = "200 ms"
_PROBABILITY: Final = 0.99


def race(scene: str, law: Law, seeds: Sequence[int]) -> Row:
    """Return the ratio of the times to a goal with the law and without haptics, for the same hands and seeds.

    The ratio is the median over the seeds; half of them pull in bells, half steadily. None if no more than half arrive.
    """
    ratios = []
    for seed in seeds:
        free_s, felt_s = _time_s(scene, "none", seed), _time_s(scene, law, seed)
        if free_s is not None:
            ratios.append(felt_s / free_s if felt_s is not None else float("inf"))
    arrived, middle = sum(ratio < float("inf") for ratio in ratios), median(ratios) if ratios else float("inf")
    row: Row = {"scene": scene, "law": law, "slowdown": middle if middle < float("inf") else None}
    return row | {"arrived": arrived, "of": len(ratios)}


@cache
def _time_s(scene: str, law: Law, seed: int) -> float | None:
    """Return the time until the tool reaches the goal; None if it touches something or takes too long."""
    approach = Approach(
        model=frozen_scene(scene),
        force_n=0.0,
        link=LINKS[_LINK],
        law=law,
        probability=_PROBABILITY,
        duration_s=_LIMIT_S,
        seed=seed,
    )
    run = PullRun(approach, make_pull("bell" if seed % 2 else "steady", seed))
    began_s = run.arm()
    axis, start_m = run.truth.approach()[0], run.tool_position_m
    for now_s in run.go_on(began_s + approach.duration_s):
        if (run.tool_position_m - start_m) @ axis >= _GOAL_M:
            return now_s - began_s
    return None
