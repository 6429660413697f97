"""Which approaches are recorded, and how: each in turn, or several processes at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

from common.errors import FeelaheadError
from feelahead.benchmarks.error.gripper import PosedGripper
from feelahead.benchmarks.error.prediction import Judged, judge
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.processes import in_processes
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind
from feelahead.lab.approaches.recording import record_approach
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.simulation.joint_reference import MotionLimits
from robot_side.simulation.scene import load_scene

DELAYS_MS: Final = (0, 25, 50, 100, 200, 400)
"""Each way."""
QUICK_DELAYS_MS: Final = (0, 50, 200, 400)
QUICK_PULLS: Final[tuple[PullKind, ...]] = ("bell", "on_off", "random")
_SCENE: Final = "empty"
_JITTER_MS: Final = 10
_JITTERS_IN_DELAY: Final = 4


@dataclass(frozen=True)
class Job:
    """One approach to record."""

    pull: PullKind
    link: str
    seed: int
    duration_s: float


def link_spec(delay_ms: int) -> str:
    """A link with this delay each way, and 10 ms of normal jitter or the quarter of the delay if that is less."""
    jitter_ms = min(_JITTER_MS, delay_ms // _JITTERS_IN_DELAY)
    return f"delay {delay_ms}ms {jitter_ms}ms distribution normal" if jitter_ms > 0 else ""


def jobs(first_seed: int, seeds: int, *, quick: bool) -> list[Job]:
    """Every pull over every link, the seeds innermost."""
    pulls, delays_ms = (QUICK_PULLS, QUICK_DELAYS_MS) if quick else (PULL_KINDS, DELAYS_MS)
    return [
        Job(pull, link_spec(delay_ms), seed, 2.0 if quick else 4.0)
        for delay_ms in delays_ms
        for pull in pulls
        for seed in range(first_seed, first_seed + seeds)
    ]


def judge_all(wanted: Sequence[Job], workers: int, advance: Callable[[], None]) -> tuple[list[Judged], list[str]]:
    """Record and judge them; what could not be recorded is told in words. `advance` is called after each."""
    outcomes: dict[int, Judged | str] = {}
    for place, outcome in in_processes(judge_job, [(job,) for job in wanted], workers):
        outcomes[place] = outcome
        advance()
    in_order = [outcomes[place] for place in sorted(outcomes)]
    judged = [outcome for outcome in in_order if isinstance(outcome, Judged)]
    return judged, [outcome for outcome in in_order if isinstance(outcome, str)]


def judge_job(job: Job) -> Judged | str:
    """Record one and compare; in words why it could not be recorded."""
    try:
        record = record_approach(job.pull, job.link, job.seed, job.duration_s, _SCENE)
    except FeelaheadError as error:
        return f"{job.pull} pull, seed {job.seed}, --link {job.link!r}: {error}"
    return judge(record, _gripper().at, MotionLimits(), full_speed_m_s())


def full_speed_m_s() -> float:
    """v_max as it is set: the robot side's own."""
    return ToolMotionSettings().trigger_speed_m_s


@cache
def _gripper() -> PosedGripper:
    return PosedGripper(load_scene(frozen_scene(_SCENE), SITE))
