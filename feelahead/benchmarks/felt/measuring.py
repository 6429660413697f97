"""Everything that is measured: recorded ticks through each setting, and approaches with each."""

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from itertools import chain
from typing import Final

from feelahead.benchmarks.felt.approaching import Approached, approach_otherwise
from feelahead.benchmarks.felt.ladders import MESHES, NODES, RATE, is_as_it_is
from feelahead.benchmarks.felt.recorded_ticks import DEMO, Recorded, record
from feelahead.benchmarks.felt.replay import Replayed, replay
from feelahead.benchmarks.felt.turning import Turned, turned
from robot_side.compiled.warm_up import warm_up

RUNS: Final = (DEMO, "wall", "mug", "u_mesh")
OF_MESHES: Final = ("mug", "u_mesh")
_DEMO_S: Final = 7.0
"""Until something is held, and lifted."""
_PULL_S: Final = 3.5


@dataclass(frozen=True)
class Plan:
    """How much of it."""

    runs: tuple[str, ...] = RUNS
    demo_s: float = _DEMO_S
    pull_s: float = _PULL_S
    times: int = 2
    """So often each tick is gone through; the least time counts."""
    scenes: tuple[str, ...] = ()
    """Of the approaches"""
    seed: int = 0


@dataclass
class Found:
    """What came of it."""

    replayed: dict[str, list[Replayed]] = field(default_factory=dict)
    """By run"""
    approached: list[Approached] = field(default_factory=list)


def measure(plan: Plan, rungs: dict[str, list[Turned]], advance: Callable[[float], None]) -> Found:
    """`advance` is told each piece that is done, of `pieces(plan, rungs)`."""
    found = Found()
    hows = list(chain.from_iterable(rungs.values()))
    # As it is stands once on each ladder, and is measured there.
    here = [how for how in hows if how.knob != NODES or is_as_it_is(how)]
    recordings = {}
    for run in plan.runs:
        recordings[run] = record(run, plan.demo_s if run == DEMO else plan.pull_s, plan.seed)
        of_run = [how for how in here if how.knob != MESHES or run in OF_MESHES]
        found.replayed[run] = replay(recordings[run], of_run, plan.times)
        advance(len(of_run))
    for how in here:
        if not how.hulls and not (is_as_it_is(how) and how.knob != RATE):
            found.approached += approach_otherwise(how, plan.scenes, plan.seed)
        advance(1.0)
    for how in hows:
        if how not in here:
            replayed, approached = _alone(how, list(recordings.values()), plan)
            for run, one in zip(plan.runs, replayed, strict=True):
                found.replayed[run].append(one)
            found.approached += approached
            advance(len(plan.runs) + 1.0)
    return found


def pieces(plan: Plan, rungs: dict[str, list[Turned]]) -> float:
    """How many there are."""
    hows = list(chain.from_iterable(rungs.values()))
    meshes = sum(how.knob == MESHES for how in hows) * sum(run not in OF_MESHES for run in plan.runs)
    return float(len(hows) * (len(plan.runs) + 1) - meshes)


def _alone(how: Turned, recordings: Sequence[Recorded], plan: Plan) -> tuple[list[Replayed], list[Approached]]:
    """In a process of its own, where kernels are compiled like this."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(_there, how, recordings, plan).result()


def _there(how: Turned, recordings: Sequence[Recorded], plan: Plan) -> tuple[list[Replayed], list[Approached]]:
    with turned(how):
        warm_up()
        replayed = [replay(recorded, [how], plan.times)[0] for recorded in recordings]
        return replayed, approach_otherwise(how, plan.scenes, plan.seed)
