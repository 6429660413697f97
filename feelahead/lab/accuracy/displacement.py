"""δ, the displacement until a command takes effect, by both sides; and where a finger stops with longer turns."""

import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.periods import PERIODS_S, TURN_S, period_text
from feelahead.lab.accuracy.points import Part, each, point
from feelahead.lab.approaches.approach import Approach, PullRun
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.outcome import SAMPLE_S
from feelahead.lab.approaches.prediction import ToolPath, judge, moments, predicted
from feelahead.lab.approaches.pulls import PullKind
from feelahead.lab.approaches.recording import record_approach
from feelahead.lab.interleaved import in_turns, processor_us
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.questions.error import link_spec
from feelahead.lab.table import Row
from robot_side.arm.limits import ArmLimits
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.scene import load_scene

TURNS_S: Final = (PERIODS_S[0], TURN_S, 0.010)
UNIT: Final = "mm of δ"
STOP_UNIT: Final = "mm of stop"
_FORCE_N: Final = 2.0
_SAMPLES: Final = 50
"""Samples of 10 ms in a chunk of a run"""
_CHUNK_S: Final = _SAMPLES * SAMPLE_S


def measure(delay_ms: int, pulls: Sequence[PullKind], seconds: float, rounds: int, seed: int) -> Iterator[Row]:
    """Measure the predictions of δ by both sides, for pulls over a link with this delay each way."""
    errors_m: dict[str, list[FloatArray]] = {"operator": [], "robot": []}
    works: dict[str, list[Callable[[], object]]] = {"operator": [], "robot": []}
    count, full_m_s, limits = 0, ToolMotionSettings().trigger_speed_m_s, ArmLimits()
    for pull in pulls:
        record = record_approach(pull, link_spec(delay_ms), seed, seconds, "empty")
        judged = judge(record, _gripper().at, limits, full_m_s)
        for side, of_pulls in errors_m.items():
            own = np.array(judged[side], dtype=float)
            of_pulls.append(own[np.array(judged["within_reach"], dtype=bool) & ~np.isnan(own)])
        at = moments(record)
        ability = ToolPath(record, _gripper().at, limits, full_m_s).ability(at.reported_s).T
        works["operator"].append(partial(predicted, record, at, *ability))
        works["robot"].append(partial(_products, ability[0].tolist(), at.loop_age_quantile_s.tolist()))
        count += len(at)
    times_us = processor_us({side: each(of_side) for side, of_side in works.items()}, rounds)
    said = {"operator": "operator's", "robot": "robot's, v t_d"}
    for side, name in said.items():
        wrong_mm = 1e3 * np.concatenate(errors_m[side])
        of, built = Part(f"δ, {delay_ms} ms each way", UNIT, "simulated arm"), side == "operator"
        yield point(of, "compensation", name, times_us[side] / count, wrong_mm, built=built)


@cache
def _gripper() -> PosedGripper:
    return PosedGripper(load_scene(frozen_scene("empty"), SITE))


def _products(speeds_m_s: list[float], ages_s: list[float]) -> list[float]:
    """Compute δ = v t_d for each moment, as a tick does: one at a time."""
    return [speed * age for speed, age in zip(speeds_m_s, ages_s, strict=True)]


def measure_turns(delay_ms: int, seconds: float, seed: int) -> Iterator[Row]:
    """Measure where a finger of 2 N stops before the wall, and the processor time of a virtual second, by the turns.

    Both sides, their link and the physics run in this process; the runs take turns, half a virtual second each.
    """
    runs, link = dict[str, PullRun](), f"delay {delay_ms}ms" if delay_ms else ""
    courses = dict[str, Iterator[float]]()
    for text in map(period_text, TURNS_S):
        approach = Approach(frozen_scene("wall"), _FORCE_N, SITE, link=link, seed=seed, tick_period=text)
        runs[text] = PullRun(approach)
        courses[text] = runs[text].go_on(runs[text].arm() + seconds)
    chunks = {text: partial(_chunk_s, course) for text, course in courses.items()}
    times_s = in_turns(chunks, round(seconds / _CHUNK_S))
    gaps_mm = {text: 0.0 if run.onset is not None else 1e3 * float(run.trace().gap_m[-1]) for text, run in runs.items()}
    shortest = period_text(TURNS_S[0])
    for text, gap_mm in gaps_mm.items():
        us = 1e6 * float(np.median(times_s[text][times_s[text] > 0.0])) / _CHUNK_S
        name = f"{text}, at {gap_mm:.2f} mm" if gap_mm > 0.0 else f"{text}, touches"
        part = f"stop, {delay_ms} ms, a virtual second"
        of = Part(part, STOP_UNIT, f"{shortest} turns")
        yield point(of, "turns of", name, us, np.array([gap_mm - gaps_mm[shortest]]), built=text == period_text(TURN_S))


def _chunk_s(course: Iterator[float]) -> FloatArray:
    began_s = time.process_time()
    done = sum(1 for _ in itertools.islice(course, _SAMPLES))
    spent_s = time.process_time() - began_s
    return np.array([spent_s if done == _SAMPLES else 0.0])
