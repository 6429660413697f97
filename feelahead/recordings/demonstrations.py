"""Demonstrations in a recording, for learning: observations, actions and pictures on an even clock."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.protocol.view_messages import VIEW_NAMES, VideoFrame
from common.recording.decoding import view_message
from common.recording.images import read_image
from common.recording.reading import Recording
from feelahead.recordings.tables import Joined, Table, Tables

MOST_HZ: Final = 30
"""Highest rate that is chosen without --fps, and the rate without pictures"""
_STRENGTHS: Final = 8
_ZONES: Final = 10
_ACTION: Final = {
    "l2": "command.l2",
    "r2": "command.r2",
    "lateral_right": "command.lateral.0",
    "lateral_up": "command.lateral.1",
    "turning_right": "command.turning.0",
    "turning_up": "command.turning.1",
    "gripper": "command.gripper",
}


class Picture(NamedTuple):
    """Picture of a camera. Times are since the recording began."""

    time_s: float
    """Time at which it was there: sent by the robot side, or arrived at an operator side that was recorded alone"""
    jpeg: bytes
    captured_s: float
    """Time of capture"""


class Vector(NamedTuple):
    """Values of one feature in each frame."""

    names: tuple[str, ...]
    """Names of the k parts"""
    values: Any
    """(n, k) float32"""
    columns: tuple[str, ...] = ()
    """Columns of the joined table from which the parts come; empty if they come from elsewhere"""


class Episode(NamedTuple):
    """Part of the frames: from row `first` to before row `end`."""

    first: int
    end: int
    success: bool | None
    """None: nobody said"""


@dataclass(frozen=True)
class Demonstrations:
    """Frames of a recording's kept episodes, at an even rate."""

    rate_hz: int
    times_s: FloatArray
    """(n,) times since the recording began"""
    vectors: Mapping[str, Vector]
    shown: Mapping[str, list[Picture]]
    """Newest picture in each frame, by camera"""
    episodes: list[Episode]
    """In order, and of all frames"""
    left_out: int = 0
    """Number of episodes that were discarded, or have no frame"""

    def words(self) -> str:
        """Return the numbers of episodes and frames, and of distinct pictures with their rate and greatest age."""
        said = [one.success for one in self.episodes]
        counts = (said.count(True), "success"), (said.count(False), "failure"), (self.left_out, "left out")
        judged = ", ".join(f"{count} {word}" for count, word in counts if count)
        words = f"{len(said)} episode{'s' * (len(said) != 1)}{f' ({judged})' * bool(judged)}"
        words += f", {len(self.times_s)} frames at {self.rate_hz} Hz"
        for column, (view, shown) in enumerate(self.shown.items()):
            distinct = len(set(shown))
            oldest_s = self.vectors["observation.picture_age_s"].values[:, column].max()
            rate_hz = distinct * self.rate_hz / len(shown)
            words += f"; {view}: {distinct} distinct pictures, {rate_hz:.1f} Hz, at most {oldest_s:.2f} s old"
        return words


def read_demonstrations(recording: Recording, tables: Tables, rate_hz: int | None = None) -> Demonstrations:
    """Read the frames; raises ConfigurationError without an arm or commands.

    rate_hz: None for the median rate of the pictures, at most `MOST_HZ`.
    """
    seen = read_pictures(recording)
    rate_hz = rate_hz or _median_rate_hz(seen)
    joined = tables.joined(rate_hz)
    parts = _vectors(joined)
    episodes, left_out = _cut(tables.table("episode"), joined.times_s, _first_whole_row(parts, seen, joined))
    rows = np.concatenate([np.arange(one.first, one.end) for one in episodes])
    times_s = np.array(joined.times_s)[rows]
    vectors = {}
    for name, columns in parts.items():
        values = np.stack([joined.numbers(column) for column in columns.values()], axis=1).astype(np.float32)
        # A value with gaps, such as a field, keeps the last one: the format has no gaps.
        vectors[name] = Vector(tuple(columns), _held(values)[rows], tuple(columns.values()))
    shown = {view: _newest(found, times_s) for view, found in seen.items()}
    if shown:
        ages_s = [times_s - [picture.captured_s for picture in pictures] for pictures in shown.values()]
        vectors["observation.picture_age_s"] = Vector(tuple(shown), np.stack(ages_s, axis=1).astype(np.float32))
    ends = np.cumsum([one.end - one.first for one in episodes]).tolist()
    begins = [0, *ends[:-1]]
    kept = [Episode(*part, one.success) for part, one in zip(zip(begins, ends, strict=True), episodes, strict=True)]
    return Demonstrations(rate_hz, times_s, vectors, shown, kept, left_out)


def _cut(marks: Table, times_s: FloatArray, first: int) -> tuple[list[Episode], int]:
    """Return the episodes by their marks, and the number of those left out; one of all rows if none was started.

    An episode ends with its result, or else with the next start, reset, or the recording. first: first row that counts.
    """
    marked = [row["mark"] for row in marks.rows]
    if "start" not in marked:
        return [Episode(first, len(times_s), None)], 0
    found: list[tuple[float, float, bool | None]] = []
    began_s, count = None, 0
    for time_s, mark in (*zip(marks.times_s, marked, strict=True), (math.inf, "reset")):
        if began_s is not None and mark != "discard":
            found.append((began_s, time_s, mark == "success" if mark in ("success", "failure") else None))
        count += mark == "start"
        began_s = time_s if mark == "start" else None
    places = [(max(first, int(at)), int(end)) for at, end in (np.searchsorted(times_s, span[:2]) for span in found)]
    kept = [Episode(*place, span[2]) for place, span in zip(places, found, strict=True) if place[0] < place[1]]
    if not kept:
        raise ConfigurationError(
            "--format lerobot: no episode was kept; valid: a recording with one of a frame or more"
        )
    return kept, count - len(kept)


def read_pictures(recording: Recording) -> dict[str, list[Picture]]:
    """Return each camera's pictures, in order; no entry for a camera without any."""
    began_ns = recording.began_ns
    wall_s = offset_s = math.nan
    found: dict[str, list[Picture]] = {}
    undated: dict[tuple[str, int], list[int]] = {}
    for message in recording.messages(["/operator/status", "/view", *(f"/camera/{view}" for view in VIEW_NAMES)]):
        logged_s, time_s = 1e-9 * message.log_ns, 1e-9 * (message.log_ns - began_ns)
        if message.topic == "/operator/status":
            status = json.loads(message.content)
            wall_s = logged_s - status["time_s"]
            offset_s = math.nan if status.get("offset_s") is None else status["offset_s"]
        elif message.topic == "/view":
            frame = view_message(message.content)
            # The pictures of a moment come first, then their messages without them.
            if isinstance(frame, VideoFrame) and (rows := undated.get((frame.view, message.log_ns))):
                age_s = frame.header.sent_s - frame.captured_s
                if "robot" not in recording.headers and math.isfinite(offset_s):
                    age_s = logged_s - wall_s - (frame.captured_s - offset_s)
                pictures, row = found[frame.view], rows.pop(0)
                pictures[row] = pictures[row]._replace(captured_s=time_s - max(0.0, age_s))
        else:
            jpeg = read_image(message.content).jpeg
            view = message.topic.removeprefix("/camera/")
            undated = {moment: rows for moment, rows in undated.items() if moment[1] == message.log_ns}
            undated.setdefault((view, message.log_ns), []).append(len(found.setdefault(view, [])))
            found[view].append(Picture(time_s, jpeg, time_s))
    return {view: found[view] for view in VIEW_NAMES if view in found}


def _median_rate_hz(seen: Mapping[str, list[Picture]]) -> int:
    """Return the median rate of the fastest camera, rounded; at most `MOST_HZ`, which holds without two pictures."""
    captured_s = [[one.captured_s for one in found] for found in seen.values() if len(found) > 1]
    least_s = min((float(np.median(np.diff(times_s))) for times_s in captured_s), default=0.0)
    return MOST_HZ if least_s <= 1.0 / MOST_HZ else max(1, round(1.0 / least_s))


def _vectors(joined: Joined) -> dict[str, dict[str, str]]:
    """Return for each feature of the dataset its parts, and the joined table's column for each part."""
    joints = [column for column in joined.columns() if column.startswith("arm.position_rad.")]
    if not joints or "command.r2" not in joined.columns():
        raise ConfigurationError("--format lerobot: arm states or commands are missing; valid: both sides recorded")
    state = {f"joint_{index}_rad": column for index, column in enumerate(joints)}
    velocity = {f"joint_{index}_rad_s": f"arm.velocity_rad_s.{index}" for index in range(len(joints))}
    vectors = {
        "observation.state": state | {"gripper_opening_m": "arm.gripper_opening_m"},
        "observation.velocity": velocity,
        "action": _ACTION,
    }
    if "stiffness.r2.course_stiffness" in joined.columns():
        vectors["observation.course_stiffness"] = {
            f"{side}_course_stiffness": f"stiffness.{side}.course_stiffness" for side in ("l2", "r2")
        }
    if "stiffness.r2.fast_m.0" in joined.columns():
        vectors["observation.onset_distances"] = {
            f"{side}_{kind}_{strength + 1}_m": f"stiffness.{side}.{kind}_m.{strength}"
            for side in ("l2", "r2")
            for kind in ("fast", "slow")
            for strength in range(_STRENGTHS)
        }
    if "controller.r2_meets" in joined.columns():
        vectors["observation.meets"] = {f"{side}_meets": f"controller.{side}_meets" for side in ("l2", "r2")}
    if "felt.r2.0" in joined.columns():
        vectors["observation.felt"] = {
            f"{side}_zone_{zone}": f"felt.{side}.{zone}" for side in ("l2", "r2") for zone in range(_ZONES)
        }
    return vectors


def _first_whole_row(
    vectors: Mapping[str, Mapping[str, str]], seen: Mapping[str, list[Picture]], joined: Joined
) -> int:
    """Return the first row from which every required column has a value and every camera a picture."""
    needed = [*vectors["observation.state"].values(), *vectors["action"].values()]
    if "observation.course_stiffness" in vectors:
        needed += vectors["observation.course_stiffness"].values()
    begins = [int(np.argmax(np.isfinite(joined.numbers(column)))) for column in needed]
    begins += [int(np.searchsorted(np.array(joined.times_s), found[0].time_s)) for found in seen.values()]
    first = max(begins)
    if first >= len(joined.times_s):
        raise ConfigurationError("--format lerobot: the recording ends before every required value has come")
    return first


def _held(values: Any) -> Any:
    """Fill each gap with the last value before it, or with 0 if there is none."""
    filled = values.copy()
    rows = np.where(np.isfinite(filled), np.arange(len(filled))[:, None], -1)
    newest = np.maximum.accumulate(rows, axis=0)
    filled = np.take_along_axis(filled, np.maximum(newest, 0), axis=0)
    return np.where(newest >= 0, filled, 0.0).astype(np.float32)


def _newest(found: list[Picture], times_s: FloatArray) -> list[Picture]:
    rows = np.searchsorted([picture.time_s for picture in found], times_s + 1e-9, side="right") - 1
    return [found[max(0, row)] for row in rows]
