"""One run of `feelahead demo --compare`: its figures, samples and pictures. Imported only on demand."""

import base64
import math
import select
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from common.companion.process import Companion
from feelahead.both_sides.grasping_trial import R2, SAMPLE_S, Trial, Watch, run_trial
from operator_side.controller.feel import MAX_STRENGTH
from robot_side.drivers.mujoco.viewpoints import Triple, Viewpoint
from robot_side.viewing.exchange import (
    Order,
    Picture,
    Refusal,
    Setup,
    decode_from_companion,
    encode,
)
from robot_side.viewing.pictures import saved_model
from robot_side.viewing.starting import MODULE

_WIDTH, _HEIGHT, _QUALITY = 480, 320, 70
_AWAY_M, _ABOVE_M, _FOVY_DEG = 0.55, 0.32, 34.0
"""Place of the eye, beside the target, and its angle of view"""
_SILENT_S: Final = 30.0


def compared_run(trial: Trial, seed: int, advance: Callable[[float], None], *, pictures: bool) -> dict[str, Any]:
    """Run a trial; return its figures, a sample every SAMPLE_S and as many pictures as JPEG in base64.

    advance: called with the seconds that have passed.
    """
    samples = _Samples(advance, pictures=pictures)
    try:
        row = run_trial(trial, seed, samples.add)
        samples.wait()
    finally:
        samples.close()
    gaps = [gap for gap in samples.columns["gap_mm"] if gap is not None]
    return {
        "figures": {**row, "least_gap_mm": min(gaps, default=None)},
        "period_s": SAMPLE_S,
        "took_s": SAMPLE_S * (len(samples.columns["gap_mm"]) - 1),
        **samples.columns,
        "pictures": samples.pictures,
        "trouble": samples.trouble,
    }


class _Samples:
    """Samples of a run at each look. Another process draws the pictures in the meantime."""

    def __init__(self, advance: Callable[[float], None], *, pictures: bool) -> None:
        self.columns: dict[str, list[Any]] = {
            name: [] for name in ("phase", "pull", "resist", "gap_mm", "speed_mm_s", "hits", "fastest_mm_s")
        }
        self.pictures: list[str] = []
        self.trouble = ""
        """Why there are no pictures"""
        self._advance = advance
        self._companion = Companion(MODULE, room_bytes=1 << 26) if pictures else None
        self._tool_m: Any = None

    def add(self, watch: Watch) -> None:
        """Take a sample, and order a picture."""
        site_m = watch.scene.data.site_xpos[watch.scene.robot.site].copy()
        moved_m = 0.0 if self._tool_m is None else float(np.linalg.norm(site_m - self._tool_m))
        first, self._tool_m = self._tool_m is None, site_m
        gap_m = watch.truth.observe().min_obstacle_distance_m
        person = watch.loopback.person
        sample = {
            "phase": str(getattr(person, "doing", "")),
            "pull": watch.loopback.device.travel[R2],
            "resist": (watch.strength_of(R2) or 0) / MAX_STRENGTH,
            "gap_mm": None if gap_m is None else 1e3 * max(gap_m, 0.0),
            "speed_mm_s": 1e3 * moved_m / SAMPLE_S,
            "hits": watch.hits.count,
            "fastest_mm_s": None if watch.hits.fastest_m_s is None else 1e3 * watch.hits.fastest_m_s,
        }
        for name, value in sample.items():
            self.columns[name].append(round(value, 3) if isinstance(value, float) else value)
        self._order(watch, first=first)
        if not first:
            self._advance(SAMPLE_S)

    def _order(self, watch: Watch, *, first: bool) -> None:
        if (companion := self._companion) is None:
            return
        if first:
            companion.channel.send(
                encode(Setup(saved_model(watch.scene), _WIDTH, _HEIGHT, {"overview": _beside(watch)}))
            )
        data = watch.scene.data
        mocap = np.concatenate([data.mocap_pos, data.mocap_quat], axis=1).tobytes()
        number = float(len(self.columns["hits"]))
        companion.channel.send(encode(Order("overview", number, data.qpos.tobytes(), mocap, _QUALITY)))
        self._take()

    def _take(self) -> None:
        if (companion := self._companion) is None:
            return
        for payload in companion.channel.receive():
            answer = decode_from_companion(payload)
            if isinstance(answer, Picture):
                self.pictures.append(base64.b64encode(answer.content).decode())
            elif isinstance(answer, Refusal):
                self.trouble = answer.reason

    def wait(self) -> None:
        """Wait for the ordered pictures."""
        while (companion := self._companion) is not None and len(self.pictures) < len(self.columns["hits"]):
            writing = [companion.channel] if companion.channel.waiting else []
            ready, room, _ = select.select([companion.channel], writing, [], _SILENT_S)
            if self.trouble or companion.channel.ended or not (ready or room):
                self.trouble = self.trouble or "the drawing process has ended"
                self.pictures.clear()
                return
            self._take()

    def close(self) -> None:
        """End the drawing process."""
        if self._companion is not None:
            self._companion.close()


def _beside(watch: Watch) -> Viewpoint:
    """Return a viewpoint beside the target, so that the approach runs across the picture."""
    data, robot = watch.scene.data, watch.scene.robot
    ahead = data.site_xmat[robot.site].reshape(3, 3)[:, 2] * (1.0, 1.0, 0.0)
    ahead /= math.hypot(*ahead)
    target = watch.truth.target()
    tool_m = data.site_xpos[robot.site]
    at_m = tool_m + 0.2 * ahead if target is None else target.position_m
    aside = np.array([ahead[1], -ahead[0], 0.0])
    eye_m = at_m - 0.02 * ahead + _AWAY_M * aside + [0.0, 0.0, _ABOVE_M]
    forward = at_m - 0.02 * ahead + [0.0, 0.0, 0.03] - eye_m
    forward /= np.linalg.norm(forward)
    up = np.array([0.0, 0.0, 1.0]) - forward[2] * forward
    up /= np.linalg.norm(up)
    return Viewpoint(position_m=_triple(eye_m), forward=_triple(forward), up=_triple(up), fovy_deg=_FOVY_DEG)


def _triple(values: Any) -> Triple:
    x, y, z = values.tolist()
    return (x, y, z)
