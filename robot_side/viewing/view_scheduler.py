"""Views that are made between ticks while somebody watches them: pictures, and the scene's state."""

import math
from collections import deque
from collections.abc import Collection
from typing import Any, Final, Protocol

from common.protocol.codec import VIEW_MAXIMUM_BYTES, encode
from common.protocol.view_messages import VIEW_NAMES, ViewName
from common.skipped import Part
from common.statistics import RunningStatistics
from robot_side.operators.operator_session import OperatorSession
from robot_side.tick.outgoing import Outgoing, OutgoingStream
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation
from robot_side.viewing.pictures import Cameras
from robot_side.viewing.scene_view import SURFACES_BYTES_PER_S, SceneView, TickFigures

SCENE_PERIOD_S: Final = 1.0 / 30.0
SHAPES_PERIOD_S: Final = 3.0
_SHAPES_BYTES_PER_S: Final = 400_000.0
_SHAPES_SHARE: Final = 0.1
"""Maximum of a link for repeated shapes, in bytes a second and as a share: large shapes are repeated less often"""
_BACKLOG_S: Final = 0.03
"""Queueing delay, in seconds, above which no view is made, because it would be old on arrival"""
_SEEN_TO_S: Final = 0.1
_EYES_PERIOD_S: Final = 0.1
_FIGURES_S: Final = 1.0


class Room(Protocol):
    """Capacity that a link has for the views."""

    @property
    def left_bit_s(self) -> float:
        """Rate left for the views, in bit/s"""
        ...

    @property
    def begins(self) -> bool:
        """Whether no limit of the link has been noticed yet"""
        ...

    def backlog_s(self, stream: OutgoingStream, now_s: float) -> float:
        """Return the queueing delay of a new message of `stream`, in seconds."""
        ...


class ViewScheduler:
    """Scheduler of the views in each turn: makes each view at most at its rate, and only while it is watched."""

    def __init__(
        self,
        session: OperatorSession,
        scene_view: SceneView,
        cameras: Cameras | None,
        room: Room,
        *,
        always: Collection[str] = (),
        seed: int = 0,
    ) -> None:
        """always: which of `overview`, `first_person` and `scene` are made even if unwatched, for the recording."""
        self._session = session
        self._scene_view = scene_view
        self._cameras = cameras
        self._room = room
        self._always = frozenset(always)
        self._ticks_s: deque[float] = deque(maxlen=250)
        self._ticks = TickFigures()
        self._next_figures_s = self._next_look_s = self._next_eyes_s = -math.inf
        self._next_s: dict[str, float] = {}
        self._late: set[str] = set()
        self._scene_hz = math.inf
        self._next_shapes_s = -math.inf
        self._begun = -1
        self._counts = {name: {"due": 0, "sent": 0, "nobody_looks": 0, "behind": 0} for name in (*VIEW_NAMES, "scene")}
        self._shapes_sent = 0
        self._frame_age = RunningStatistics(seed)

    def ticked(self, took_s: float, overruns: int) -> None:
        """Count a tick's duration, for SceneState."""
        self._ticks_s.append(took_s)
        self._ticks.overruns = overruns

    def idle(self, now_s: float, taken_s: float, newest: tuple[Sensed, Situation] | None) -> list[Outgoing]:
        """Return the messages with views to send now.

        newest: the law's result and situation in the newest tick, at `taken_s`, which the views show.
        """
        looked_at = self._session.watchers.looked_at(now_s) | self._always
        if not looked_at and now_s < self._next_look_s:
            return []
        self._next_look_s = now_s + _SEEN_TO_S
        owner = self._session.lease.owner
        of = None if owner is None else owner.epoch
        # What is recorded is made as asked, however slow the page that watches.
        paced = (math.inf, False, math.inf) if self._always else self._session.watchers.pace(of, now_s)
        most_hz, halved, self._scene_hz = paced
        if self._cameras is not None:
            control = self._cameras.picture_rate_control
            control.most_hz, control.halved = most_hz, halved
        due = set()
        for name, counts in self._counts.items():
            turns = self._turns(name, now_s)
            counts["due"] += turns
            if name not in looked_at:
                counts["nobody_looks"] += turns
            elif turns:
                due.add(name)
        outgoing = self._pictures(now_s, taken_s, due, looked_at)
        if "scene" in looked_at and newest is not None:
            outgoing += self._scene(now_s, taken_s, newest, is_due="scene" in due)
        return outgoing

    def summary(self) -> dict[str, Any]:
        """Return the summary's entry `looked_at`: for each view and the scene, how many were due, sent, or why not."""
        cameras, counts = self._cameras, {name: dict(counts) for name, counts in self._counts.items()}
        counts["scene"]["shapes"] = self._shapes_sent
        took_s = sorted(cameras.took_s) if cameras is not None else []
        middle = 1e3 * took_s[len(took_s) // 2] if took_s else None
        starts = 0 if cameras is None else cameras.starts
        age = {f"p{q}": None if (s := self._frame_age.quantile(q / 100)) is None else 1e3 * s for q in (50, 99)}
        return counts | {"companion": {"starts": starts, "picture_ms": middle, "picture_age_ms": age}}

    @property
    def pictures_sent(self) -> Part:
        """Pictures that were sent, of those that were due at the rate of the time; of 0 without cameras"""
        views = [] if self._cameras is None else [self._counts[name] for name in VIEW_NAMES]
        return Part(sum(one["sent"] for one in views), sum(one["due"] for one in views))

    @property
    def pictures(self) -> dict[str, float | int] | None:
        """Present `rate_hz`, `quality` and `size` (share of the full width) of pictures; None without cameras"""
        if self._cameras is None:
            return None
        step = self._cameras.picture_rate_control.step
        return {"rate_hz": step.rate_hz, "quality": step.quality, "size": 0.5 if step.halved else 1.0}

    def close(self) -> None:
        """End the companion process that renders."""
        if self._cameras is not None:
            self._cameras.close()

    def _turns(self, name: str, now_s: float) -> int:
        """Return how many times the view `name` has become due since the last call."""
        rate_hz = None if name == "scene" or self._cameras is None else self._cameras.picture_rate_control.step.rate_hz
        period_s = max(SCENE_PERIOD_S, 1.0 / self._scene_hz) if rate_hz is None else 1.0 / rate_hz
        # The views alternate, so that neither waits for the other.
        next_s = self._next_s.setdefault(name, now_s + (0.5 * period_s if name == VIEW_NAMES[1] else 0.0))
        if now_s < next_s:
            return 0
        turns = 1 + math.floor((now_s - next_s) / period_s)
        self._next_s[name] = next_s + turns * period_s
        return turns

    def _pictures(
        self, now_s: float, taken_s: float, due: Collection[str], looked_at: frozenset[str]
    ) -> list[Outgoing]:
        cameras = self._cameras
        if cameras is None:
            return []
        views = len(looked_at & set(VIEW_NAMES))
        cameras.hear(now_s, watched=views > 0)
        # Recorded pictures are JPEG: replay and export begin anywhere.
        lacks = None if self._always else self._session.watchers.lacks(now_s)
        h264 = cameras.makes_h264(lacks, now_s)
        cameras.picture_rate_control.update(self._room.left_bit_s, views, now_s, eager=self._room.begins, h264=h264)
        wanted: list[ViewName] = []
        full = self._room.backlog_s("video", now_s) > _BACKLOG_S
        # A late view is made as soon as there is room: at its next turn the other one could be first again.
        self._late &= looked_at
        for name in VIEW_NAMES:
            if cameras.works and (name in due or name in self._late):
                behind = cameras.busy(name) or full
                if behind or not cameras.has_news(name):
                    self._counts[name]["behind"] += behind and name in due
                    self._late.add(name)
                else:
                    self._late.discard(name)
                    wanted.append(name)
        outgoing = []
        expected = self._session.watchers.expected(now_s)
        for picture in cameras.update(now_s, taken_s, wanted, lacks, expected=expected):
            self._counts[picture.view]["sent"] += 1
            self._frame_age.add(now_s - picture.captured_s)
            frame = cameras.message(picture, self._session.shown_header(now_s))
            outgoing.append(Outgoing("video", b"", encode(frame)))
        return outgoing

    def _scene(self, now_s: float, taken_s: float, newest: tuple[Sensed, Situation], *, is_due: bool) -> list[Outgoing]:
        view, session, (sensed, situation) = self._scene_view, self._session, newest
        others = view.outdated(situation.objects)
        if self._cameras is not None and now_s >= self._next_eyes_s:
            new = view.look_from(self._cameras.sent_eyes())
            others = others or new
            # Shapes are large: a camera that zooms does not have them sent with each picture.
            self._next_eyes_s = now_s + (SHAPES_PERIOD_S if new else _EYES_PERIOD_S)
        if self._begun != session.watchers.scene_begun or others:
            self._begun = session.watchers.scene_begun
            self._next_shapes_s = now_s
            if others or not view.complete:
                view.begin_shapes(session.shown_header(now_s), situation)
        if not view.work_on_shapes() or view.shapes is None:
            return []
        if now_s >= self._next_shapes_s:
            most_bytes_per_s = min(_SHAPES_BYTES_PER_S, _SHAPES_SHARE * self._room.left_bit_s / 8.0)
            self._next_shapes_s = now_s + max(SHAPES_PERIOD_S, view.shapes_bytes / most_bytes_per_s)
            if view.shapes_bytes > VIEW_MAXIMUM_BYTES:
                return []
            self._shapes_sent += 1
            return [Outgoing("scene", b"", view.shapes.under(session.shown_header(now_s)))]
        if is_due and self._room.backlog_s("scene", now_s) > _BACKLOG_S:
            self._counts["scene"]["behind"] += 1
        elif is_due:
            surfaces_bytes_per_s = min(SURFACES_BYTES_PER_S, _SHAPES_SHARE * self._room.left_bit_s / 8.0)
            view.begin_state(sensed, situation, taken_s, surfaces_bytes_per_s)
            return []
        state = view.work_on_state(lambda: session.shown_header(now_s), self._ticks)
        if state is None:
            return []
        self._counts["scene"]["sent"] += 1
        self._work_out_figures(now_s)
        return [Outgoing("scene", b"", encode(state))]

    def _work_out_figures(self, now_s: float) -> None:
        if now_s >= self._next_figures_s and self._ticks_s:
            self._next_figures_s = now_s + _FIGURES_S
            latest_s = sorted(self._ticks_s)
            self._ticks.p50_us = 1e6 * latest_s[len(latest_s) // 2]
            self._ticks.p99_us = 1e6 * latest_s[len(latest_s) * 99 // 100]
