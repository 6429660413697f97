"""Outcome of a trial, from its recording alone."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from common.arrays import FloatArray
from common.recording.reading import open_recording
from common.recording.topics import TYPES, Truth
from feelahead.study.protocol import STANDS_S

_TRUTH: Final = "/truth"
_STATUS: Final = "/robot/status"
_MOVING_M_S: Final = 0.01
NEAR_MM: Final = 5.0
"""Distance to an obstacle below which a gripper is exposed"""


@dataclass(frozen=True)
class Outcome:
    """What came out of a trial: the columns of the study's table that a recording knows."""

    completed: bool
    """Whether the target was lifted and put down, and had stood by itself for STANDS_S in time"""
    time_s: float | None
    """Time from arming until it began to stand so; None if it did not"""
    contacts: int
    """Contacts of the gripper with all but the target, and of what it held with obstacles"""
    hit: bool
    fastest_mm_s: float | None
    """Greatest closing speed of these contacts"""
    impulse_n_s: float
    """Sum over time of their normal forces"""
    path_m: float
    """Way of the tool"""
    least_mm: float | None
    """Least distance of the gripper from an obstacle, negative inside it; None beyond 1 m"""
    exposure_s: float
    """Time for which it was less than NEAR_MM"""
    enlargement_mm: float | None
    """Mean enlargement of the gripper while the tool moved, which a fair `margin_m` equals; None if it was not known"""


def outcome_of(recording: Path, limit_s: float) -> Outcome | None:
    """Return the outcome of the trial that the file at `recording` has; None if the arm was never armed.

    It ends when the target begins to stand for STANDS_S, `limit_s` after arming, or with the recording.
    ConfigurationError for a file that is no recording, or has no truth, as with an arm that is not simulated.
    """
    opened = open_recording(recording)
    opened.require((_TRUTH,))
    decoders = {_TRUTH: msgspec.json.Decoder(Truth).decode, _STATUS: msgspec.json.Decoder(TYPES[_STATUS]).decode}
    found: dict[str, list[Any]] = {topic: [] for topic in decoders}
    for message in opened.messages(tuple(topic for topic in decoders if topic in opened.topics)):
        found[message.topic].append(decoders[message.topic](message.content))
    known = [(one.time_s, one.enlargement_mm) for one in found[_STATUS] if one.enlargement_mm is not None]
    return outcome(found[_TRUTH], limit_s, known)


def outcome(truths: list[Truth], limit_s: float, enlargements: Sequence[tuple[float, float]] = ()) -> Outcome | None:
    """Return the outcome of a trial with these truths, in order of time; None if the arm was never armed.

    enlargements: times in seconds, each with the enlargement in mm that the law had then.
    """
    first = next((place for place, truth in enumerate(truths) if truth.armed), None)
    if first is None:
        return None
    began_s = truths[first].time_s
    stood_s = _stood_s(truth for truth in truths[first:] if truth.time_s <= began_s + limit_s)
    completed = stood_s is not None
    end_s = began_s + limit_s if stood_s is None else stood_s
    those = [truth for truth in truths[first:] if truth.time_s <= end_s]
    before, last = truths[max(first - 1, 0)], those[-1]
    tool_m = np.array([truth.tool_m for truth in those])
    times_s = np.array([truth.time_s for truth in those])
    gaps_mm = np.array([math.inf if truth.obstacle_mm is None else truth.obstacle_mm for truth in those])
    return Outcome(
        completed=completed,
        time_s=end_s - began_s if completed else None,
        contacts=last.hits - before.hits,
        hit=last.hits > before.hits,
        fastest_mm_s=last.fastest_hit_mm_s if last.hits > before.hits else None,
        impulse_n_s=last.impulse_n_s - before.impulse_n_s,
        path_m=float(np.linalg.norm(np.diff(tool_m, axis=0), axis=1).sum()),
        least_mm=None if np.isinf(gaps_mm.min()) else float(gaps_mm.min()),
        exposure_s=float(np.diff(times_s)[gaps_mm[:-1] < NEAR_MM].sum()),
        enlargement_mm=_mean_moving(enlargements, times_s, tool_m),
    )


def _mean_moving(enlargements: Sequence[tuple[float, float]], times_s: FloatArray, tool_m: FloatArray) -> float | None:
    """Return the mean of the enlargements between the first time and the last, while the tool moved; None without."""
    those = np.array([one for one in enlargements if times_s[0] < one[0] <= times_s[-1]]).reshape(-1, 2)
    at_s = np.concatenate([times_s[:1], those[:, 0]])
    places_m = np.column_stack([np.interp(at_s, times_s, along_m) for along_m in tool_m.T])
    moved = np.linalg.norm(np.diff(places_m, axis=0), axis=1) > _MOVING_M_S * np.diff(at_s)
    return float(those[moved, 1].mean()) if moved.any() else None


def _stood_s(truths: Iterable[Truth]) -> float | None:
    """Return when the target began to stand for STANDS_S; None if it never did."""
    since_s: float | None = None
    for truth in truths:
        since_s = None if not truth.placed else truth.time_s if since_s is None else since_s
        if since_s is not None and truth.time_s - since_s >= STANDS_S - 1e-9:
            return since_s
    return None
