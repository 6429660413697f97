"""What a law costs: the time to a goal in the free, over that without haptics, for the same hand and seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from statistics import median

from feelahead.benchmarks.coverage.cells import LINKS
from feelahead.benchmarks.coverage.evaluate import mean_way_m
from feelahead.benchmarks.coverage.replay import Replay
from feelahead.lab.approaches.approach import Approach, time_to_goal_s
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.laws import Law
from feelahead.lab.approaches.pulls import PullKind, make_pull
from feelahead.lab.approaches.recording import record_approach
from feelahead.lab.approaches.spoilt import Spoil
from robot_side.settings import EncoderSettings
from robot_side.simulation.scene import load_scene

SCENES = ("empty", "cluttered")
GOAL_M = 0.25
_LIMIT_S = 15.0
_LINK = "200 ms"
_PROBABILITY = 0.99


@dataclass(frozen=True)
class Slowdown:
    """One law in one scene."""

    scene: str
    law: Law
    ratio: float | None
    """The median over the seeds of time over time without haptics; None where most never arrive."""
    arrived: int
    seeds: int


def race(scene: str, law: Law, seeds: Sequence[int], spoil: Spoil = "nothing") -> Slowdown:
    """The ratio over hands that pull in bells and steadily."""
    ratios = []
    for seed in seeds:
        free_s, felt_s = _time_s(scene, "none", seed, "nothing"), _time_s(scene, law, seed, spoil)
        if free_s is not None:
            ratios.append(felt_s / free_s if felt_s is not None else float("inf"))
    arrived = sum(ratio < float("inf") for ratio in ratios)
    middle = median(ratios) if ratios else float("inf")
    return Slowdown(scene, law, middle if middle < float("inf") else None, arrived, len(ratios))


@cache
def _time_s(scene: str, law: Law, seed: int, spoil: Spoil) -> float | None:
    approach = Approach(
        model=frozen_scene(scene),
        force_n=0.0,
        link=LINKS[_LINK],
        law=law,
        duration_s=_LIMIT_S,
        seed=seed,
        probability=_PROBABILITY,
        margin_m=_margin_m(seed) if law == "margin" else None,
        spoil=spoil,
    )
    return time_to_goal_s(approach, make_pull(_kind(seed), seed), GOAL_M)


def _kind(seed: int) -> PullKind:
    return "bell" if seed % 2 else "steady"


@cache
def _margin_m(seed: int) -> float:
    """How far ahead the law swept feels on average in this very pull."""
    scene = load_scene(frozen_scene("empty"), SITE)
    replay = Replay(record_approach(_kind(seed), LINKS[_LINK], seed), scene, EncoderSettings(), seed)
    return mean_way_m([replay])
