"""Made-up content for a console: an arm that sways before a table, as the two sides would report it."""

import math
from typing import Literal

import numpy as np
import simplejpeg
from numpy.typing import NDArray

from common.protocol.codec import encode
from common.protocol.messages import Header, MotionState
from common.protocol.session import SessionState
from common.protocol.view_messages import (
    VIEW_NAMES,
    EnlargementTerms,
    Eye,
    Near,
    SceneShapes,
    SceneState,
    Shape,
    ShapeKind,
    VideoFrame,
    ViewName,
)
from common.status.codes import Doing, InputSource, LinkState
from common.status.statuses import OperatorStatus
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts import FACTS_PERIOD_S, DelayFacts, OperatorFacts, TriggerFacts

OFFSET_S = 1000.0
"""Robot side's clock minus ours, in seconds"""
STILL = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
OBJECTS = ("table", "mug", "bottle", "box", "lamp")
WAYS = (0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09)
ADVANCES_ALONG_X = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
"""Quaternion (w, x, y, z) that turns the tool's z axis to the world's x axis"""


def header(now_s: float, sequence: int = 1) -> Header:
    return Header(epoch=1, sequence=sequence, sent_s=now_s + OFFSET_S)


def facts(now_s: float, state: MotionState = "armed", advancing: Literal["L2", "R2"] = "R2") -> OperatorFacts:
    pull = 0.5 - 0.5 * math.cos(now_s)
    strongest = round(8 * pull)
    zones = tuple(max(0, strongest - (9 - zone)) for zone in range(10))
    r2 = TriggerFacts(pull, 0.9 * pull, zones, zones[int(6.7 * pull)], 0.4, pull, 0.08 * pull, WAYS, WAYS)  # type: ignore[arg-type]
    l2 = TriggerFacts(0.0, 0.0, (0,) * 10, 0, 1.0, 0.1, 0.01, WAYS, WAYS)
    return OperatorFacts(
        now_s=now_s,
        offset_s=OFFSET_S,
        status=OperatorStatus(
            link=LinkState.UP,
            state=state,
            owner=SessionState(state),
            target="mug",
            holding=False,
            person=Doing.ADVANCING if state == "armed" else Doing.RESTING,
            stopped_because="a button" if state == "stopped" else None,
        ),
        screen=None,
        l2=l2,
        r2=r2,
        rumble=0.0,
        advancing=advancing,
        to_operator=DelayFacts("", 52.0, 61.0, 52.0 + 6.0 * math.sin(7.0 * now_s)),
        to_robot=DelayFacts("delay 50ms 10ms distribution normal", 49.0, 58.0, 49.0 + 5.0 * math.cos(5.0 * now_s)),
        round_trip_ms=101.0,
        field_age_ms=1.0,
        hands=InputSource.PERSON,
        may_tune=False,
        probability=None,
    )


class Pictures:
    """Changing JPEG pictures of 640 x 480 pixels and about 25 kB each."""

    def __init__(self) -> None:
        generator = np.random.default_rng(0)
        rows, columns = np.mgrid[0:480, 0:640]
        self._jpegs = {}
        for view in VIEW_NAMES:
            for step in range(8):
                base = 90 + 60 * np.sin(columns / 70 + step / 4) + 50 * np.cos(rows / 60)
                noise = np.repeat(np.repeat(generator.normal(0, 28, (120, 160)), 4, 0), 4, 1)
                picture = np.stack([base + noise, base, 255 - base + noise / 2], axis=2)
                pixels: NDArray[np.uint8] = np.clip(picture, 0, 255).astype(np.uint8)
                self._jpegs[view, step] = simplejpeg.encode_jpeg(np.ascontiguousarray(pixels), quality=75)

    def frame(self, view: ViewName, now_s: float, step: int, captured_s: float | None = None) -> bytes:
        """Encode picture number `step`. captured_s: time on this machine's clock; `now_s` if None."""
        taken_s = (now_s if captured_s is None else captured_s) + OFFSET_S
        jpeg = self._jpegs[view, step % 8]
        return encode(VideoFrame(header(now_s), view=view, captured_s=taken_s, width=640, height=480, jpeg=jpeg))


def shapes(version: int = 1) -> bytes:
    def shape(
        owner: int, kind: ShapeKind, size: tuple[float, float, float], place: tuple[float, float, float], robot: bool
    ) -> Shape:
        color = (0.75, 0.78, 0.82, 1.0) if robot else (0.6, 0.6, 0.6, 1.0)
        return Shape(owner, robot, kind, size, (*place, 1.0, 0.0, 0.0, 0.0), color)

    return encode(
        SceneShapes(
            header(0.0),
            version=version,
            links=("base", "arm", "hand"),
            objects=OBJECTS,
            shapes=(
                shape(0, "cylinder", (0.08, 0.1, 0.0), (0.0, 0.0, 0.1), robot=True),
                shape(1, "capsule", (0.05, 0.2, 0.0), (0.0, 0.0, 0.4), robot=True),
                shape(2, "box", (0.03, 0.08, 0.04), (0.0, 0.0, 0.0), robot=True),
                shape(2, "capsule", (0.04, 0.12, 0.0), (-0.15, 0.0, 0.0), robot=True),
                shape(0, "box", (0.35, 0.5, 0.02), (0.55, 0.0, -0.02), robot=False),
                shape(1, "cylinder", (0.04, 0.05, 0.0), (0.62, 0.0, 0.05), robot=False),
                shape(2, "capsule", (0.03, 0.1, 0.0), (0.6, 0.22, 0.13), robot=False),
                shape(3, "box", (0.06, 0.06, 0.06), (0.55, -0.25, 0.06), robot=False),
                shape(4, "ellipsoid", (0.05, 0.05, 0.1), (0.75, 0.12, 0.1), robot=False),
            ),
            left_out=3,
            eye=Eye((-0.1, 0.0, -0.3), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), 70.0),
            overview_eye=Eye((0.5, 0.0, 1.2), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), 60.0),
        )
    )


def state(now_s: float, version: int = 1) -> bytes:
    reach = 0.38 + 0.08 * (0.5 - 0.5 * math.cos(now_s))
    links = np.array([STILL, STILL, (reach, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0)], np.float32)
    generator = np.random.default_rng(1)
    spheres = np.column_stack(
        [
            np.array((reach, 0.0, 0.2)) + generator.uniform((-0.03, -0.08, -0.04), (0.06, 0.08, 0.04), (246, 3)),
            np.full(246, 0.01),
        ]
    ).astype(np.float32)
    poses = np.tile(np.array(STILL, np.float32), (len(OBJECTS), 1))
    terms = EnlargementTerms(0.012, 0.004, 0.001, 0.003, 0.002, 2.33, 0.1, 0.02)
    overlap_m3 = 4e-6 * (0.5 - 0.5 * math.cos(now_s))
    return encode(
        SceneState(
            header(now_s),
            version=version,
            taken_s=now_s + OFFSET_S,
            link_poses=links.tobytes(),
            object_index=np.arange(len(OBJECTS), dtype=np.uint32).tobytes(),
            object_poses=poses.tobytes(),
            roles=bytes((2, 1, 0, 0, 3)),
            tool_pose=(reach + 0.06, 0.0, 0.2, *ADVANCES_ALONG_X),
            spheres=spheres.tobytes(),
            overlaps=((1, 0.0, overlap_m3), (2, 0.3e-6, 0.1 * overlap_m3)),
            l2=terms,
            r2=terms,
            tick_p50_us=70.0 + 5.0 * math.sin(now_s),
            tick_p99_us=130.0,
            overruns=0,
            near=Near("mug", 0.08, 0.08),
        )
    )


class Feed:
    """Feeds a console with facts, pictures and scene 30 times a second; `step` must be called often."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._pictures = Pictures()
        self._count = 0
        self._next_s = 0.0

    def step(self, now_s: float) -> None:
        self._console.receive(now_s)
        if now_s < self._next_s:
            return
        self._next_s = max(now_s, self._next_s + FACTS_PERIOD_S)
        if self._count % 60 == 0:
            self._console.view(shapes(), video=False)
        self._console.facts(facts(now_s))
        for view in VIEW_NAMES:
            self._console.view(self._pictures.frame(view, now_s, self._count), video=True)
        self._console.view(state(now_s), video=False)
        self._count += 1 if self._console.pages else 0
