"""Coverage and false alarms of one motion, which is recorded once and then judged for every cell, law and P.

An approach is covered if full strength came in time: 0.25 s before the last release that avoids the contact, the
farthest zone that the trigger had reached by then was at full strength.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from itertools import count
from typing import Final

import numpy as np
from scipy.stats import bootstrap

from common.arrays import FloatArray
from common.reaction import REACTION_S
from feelahead.lab.approaches.frozen import PASSED, SITE, frozen_scene
from feelahead.lab.approaches.judging import false_alarms, strength_before_release
from feelahead.lab.approaches.laws import TriedLaw, paper_figures, with_papers
from feelahead.lab.approaches.placements import Collision, first_touch_s, place
from feelahead.lab.approaches.pulls import PullKind
from feelahead.lab.approaches.recorded_depth import RecordedDepth
from feelahead.lab.approaches.recording import record_approach
from feelahead.lab.approaches.replay import Replay
from feelahead.lab.approaches.strengths import Draw, Judged
from feelahead.lab.table import Row
from operator_side.controller.feel import MAX_STRENGTH
from robot_side.depth.camera_settings import DepthCameraSettings
from robot_side.depth.frames import SurfaceFrames
from robot_side.depth.settings import MapSettings
from robot_side.drivers.mujoco.camera import CameraError
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.laws.paper_settings import PaperSettings
from robot_side.settings import CameraSettings, EncoderSettings

LINKS: Final = {
    "0 ms": "",
    "50 ms": "delay 50ms 10ms distribution normal",
    "100 ms": "delay 100ms 10ms distribution normal",
    "200 ms": "delay 200ms 10ms distribution normal",
    "400 ms": "delay 400ms 10ms distribution normal",
    "200 ms, 5 % lost": "delay 200ms 10ms distribution normal loss 5%",
}
"""Links by name; the same words hold in both directions."""
_RESAMPLED: Final = 2000
_LEAST_APPROACHES: Final = 10
"""Minimum number of approaches for the figure `holds`; over two equal ones the bootstrap's interval has width 0."""


@dataclass(frozen=True)
class Placement:
    """One cell of the grid: a scene, the errors of camera and encoders, and the objects' speed."""

    scene: str
    camera_mm: float = 3.0
    encoder_factor: float = 1.0
    """Factor by which the encoder errors of the settings are multiplied."""
    speed_m_s: float = 0.0
    """Speed of the objects along the approach, in m/s; below 0 they come nearer."""
    depth: DepthCameraSettings | None = None
    """Depth cameras that perceive the objects; None: the objects themselves are perceived."""

    @property
    def seen_by(self) -> str:
        """What perceives the objects, as it is printed"""
        if self.depth is None:
            return "objects"
        return f"{self.depth.eyes}, noise x{self.depth.noise:g}, mount {1e3 * self.depth.mount_error_m:g} mm"

    @property
    def shown(self) -> str:
        """Name of the scene, and how its objects move, as it is printed."""
        if self.speed_m_s == 0.0:
            return self.scene
        return f"{self.scene} {'fleeing' if self.speed_m_s > 0.0 else 'coming'} {1e3 * abs(self.speed_m_s):g} mm/s"

    def key(self, pull: str, link: str) -> str:
        """Return the cell's name, which --only searches."""
        drawn = f"camera {self.camera_mm:g} mm", f"encoders x{self.encoder_factor:g}"
        return "/".join((self.shown, pull, link, *drawn, *(() if self.depth is None else (self.seen_by,))))


@dataclass(frozen=True)
class Pulls:
    """One kind of motion over one link, which is recorded several times, and the cells for which it is judged."""

    pull: PullKind
    link: str
    """Name of the link, a key of LINKS."""
    home: str
    """Scene in whose home pose the approaches start."""
    cells: tuple[Placement, ...]
    sizes: tuple[int, int]
    """Number of approaches, and of object placements for each."""
    probabilities: tuple[float, ...]
    laws: tuple[TriedLaw, ...]
    papers: tuple[PaperSettings, ...] = (PaperSettings(),)
    """Settings with each of which the paper's laws are judged"""
    judged_s: float = 60.0
    """Seconds with R2 pulled, at least, in which false alarms are counted for each cell."""


@dataclass
class _Counts:
    """Counts of one law at one probability P. `draws` and `hits` (covered draws) have one entry for each approach."""

    hits: list[int] = field(default_factory=list)
    draws: list[int] = field(default_factory=list)
    alarms: int = 0
    alarm_s: float = 0.0
    judged_s: float = 0.0


@dataclass(frozen=True)
class _Staged:
    """One recorded approach in one cell, with all placements of the objects that are tried."""

    replay: Replay
    posed: PosedScene
    collisions: tuple[Collision, ...]
    """Placements in which the approach collides; empty if none does, and then the objects stay as in the scene."""
    sought: int
    """Number of placements that were tried"""

    @property
    def avoidable(self) -> tuple[tuple[Collision, float], ...]:
        """Collisions that a release can avoid, each with the time of the last release that does."""
        return tuple((one, one.last_release_s) for one in self.collisions if one.last_release_s is not None)

    @property
    def knowable(self) -> tuple[tuple[Collision, float], ...]:
        """Avoidable collisions in which the sticks do not change between judgement and last release.

        If they change, the collision cannot be predicted.
        """
        moves = self.replay.moves_sticks
        return tuple((one, last_s) for one, last_s in self.avoidable if not moves(last_s - REACTION_S, last_s))

    def draw(self, shift_m: FloatArray, cell: Placement, number: int) -> Draw:
        """Return the approach to objects moved by shift_m (3,), perceived with the camera's `number`-th error."""
        record, names = self.replay.record, tuple(thing.name for thing in self.posed.scene.objects)
        sd_m = 1e-3 * cell.camera_mm
        if cell.depth is not None:
            rig = _rig(cell.scene, cell.depth, cell.encoder_factor)
            moved, seed = (shift_m, cell.speed_m_s), seed_of(record.seed, number)
            seen = RecordedDepth(self.replay, self.posed, rig, *moved, lambda: _frames(sd_m), seed)
            return Draw(self.replay, seen.at, sd_m, cell.speed_m_s)
        errors_m = CameraError(names, 0.0, sd_m, 0.0, seed_of(record.seed, number)).next_frame()
        self.posed.set_pose(record.joint_positions_rad[0], record.finger_positions[0], shift_m)
        return Draw(self.replay, self.posed.perceived(errors_m), sd_m, cell.speed_m_s)


def evaluate(pulls: Pulls, seed: int) -> Iterator[Row]:
    """Record the motion, and yield a row for each cell, law and P; the same seed gives the same rows."""
    approaches, places = pulls.sizes
    records = [
        record_approach(pulls.pull, LINKS[pulls.link], seed_of(seed, number), scene_name=pulls.home)
        for number in range(approaches)
    ]
    for cell in pulls.cells:
        scene = _scene(cell.scene)
        encoder = EncoderSettings(sigma_rad=cell.encoder_factor * EncoderSettings().sigma_rad)
        staged = [_stage(cell, Replay(record, scene, encoder, record.seed), places) for record in records]
        for probability in pulls.probabilities:
            for name, paper in with_papers(pulls.laws, pulls.papers):
                counts, law = _Counts(), Judged(name, probability, paper or PaperSettings())
                _count_covered(counts, law, cell, staged)
                _count_alarms(counts, law, cell, staged, pulls.judged_s)
                row: Row = {"cell": cell.key(pulls.pull, pulls.link), "scene": cell.shown}
                row |= {"camera_mm": cell.camera_mm, "encoder_factor": cell.encoder_factor, "seen_by": cell.seen_by}
                row |= {"law": name, "probability": probability, **paper_figures(paper)}
                yield row | _figures(counts, staged, probability)


@cache
def _scene(name: str) -> Scene:
    return load_scene(frozen_scene(name), SITE)


def _frames(sd_m: float) -> SurfaceFrames:
    return SurfaceFrames(MapSettings().slots, sd_m, CameraSettings().unseen_m_s)


@lru_cache(maxsize=1)
def _rig(scene: str, depth: DepthCameraSettings, encoder_factor: float) -> DepthRig:
    encoder = Encoder(encoder_factor * EncoderSettings().sigma_rad, EncoderSettings().resolution_rad)
    return DepthRig(_scene(scene), depth, MapSettings(), encoder, 0)


def seed_of(*numbers: int) -> int:
    """Return one seed that is derived from several numbers."""
    return int(np.random.SeedSequence(numbers).generate_state(1)[0] >> 1)


def _stage(cell: Placement, replay: Replay, places: int) -> _Staged:
    posed = PosedScene(_scene(cell.scene))
    if cell.scene in PASSED:
        return _Staged(replay, posed, (), 0)
    generator = np.random.default_rng([replay.record.seed, 0x71ACE])
    found = [place(replay, posed, generator, cell.speed_m_s) for _ in range(places)]
    return _Staged(replay, posed, tuple(one for one in found if one is not None), places)


def _count_covered(counts: _Counts, law: Judged, cell: Placement, staged: Sequence[_Staged]) -> None:
    """Count how many draws are covered: at least 10 / (1 - P) draws, equally many for each approach with a contact."""
    useful = [one for one in staged if one.knowable]
    least = math.ceil(draws_needed(law.probability) / max(1, len(useful)))
    for one in useful:
        # The same number of draws for each placement, at every P.
        each = len(one.knowable) * math.ceil(least / len(one.knowable))
        hits = 0
        for number in range(each):
            collision, last_release_s = one.knowable[number % len(one.knowable)]
            draw = one.draw(collision.shift_m, cell, number)
            hits += strength_before_release(law, draw, last_release_s) == MAX_STRENGTH
        counts.hits.append(hits)
        counts.draws.append(each)


def _count_alarms(counts: _Counts, law: Judged, cell: Placement, staged: Sequence[_Staged], least_s: float) -> None:
    """Count false alarms until `least_s` seconds are judged: one draw of each approach, then its next placement."""
    places = [(one, found) for one in staged if (found := _places(cell, one))]
    for number in count():
        before_s = counts.judged_s
        for one, found in places:
            if counts.judged_s < least_s:
                shift_m, until_s = found[number % len(found)]
                alarms = false_alarms(law, one.draw(shift_m, cell, number), one.posed, shift_m, until_s)
                counts.alarms += alarms.number
                counts.alarm_s += alarms.alarm_s
                counts.judged_s += alarms.judged_s
        if counts.judged_s == before_s:
            break


def _places(cell: Placement, one: _Staged) -> list[tuple[FloatArray, float]]:
    """Return for each placement the objects' shift (3,), and the time of the contact or else of the approach's end."""
    if cell.scene not in PASSED:
        return [(at.shift_m, at.touch_s) for at in one.collisions]
    # A drift or a turn may touch objects that a straight approach passes.
    touch_s = first_touch_s(one.replay, one.posed, np.zeros(3))
    return [(np.zeros(3), one.replay.end_s if touch_s is None else touch_s)]


def draws_needed(probability: float) -> int:
    """Return the smallest n >= 10 / (1 - P), for which ten uncovered draws are expected."""
    return int(np.ceil(10.0 / (1.0 - probability) - 1e-9))


def interval(hits: Sequence[int], draws: Sequence[int]) -> tuple[float, float]:
    """Return the 95 % interval of hits / draws, by a bootstrap over approaches.

    Whole approaches are resampled, as the draws of one approach are not independent.
    """
    counts = np.asarray(hits, dtype=np.float64), np.asarray(draws, dtype=np.float64)
    if len(hits) < 2:
        return hits[0] / draws[0], hits[0] / draws[0]

    def share(hit: FloatArray, drawn: FloatArray, axis: int = -1) -> FloatArray:
        found: FloatArray = hit.sum(axis) / drawn.sum(axis)
        return found

    rng = np.random.default_rng([0, 0xB007])
    found = bootstrap(counts, share, paired=True, n_resamples=_RESAMPLED, method="percentile", rng=rng)
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def _figures(counts: _Counts, staged: Sequence[_Staged], probability: float) -> Row:
    """Compute the figures from the counts; coverage is None if nothing collides or no release avoids it.

    holds: true if the interval's lower end is at least P - 0.1 (1 - P), over 10 approaches or more.
    unavoidable: number of placements in which no release avoids the contact.
    unknowable: number of placements in which the sticks change between judgement and last release.
    judged_s: judged time with R2 pulled. alarm_share: share of it with a false alarm.
    """
    draws, covered = sum(counts.draws), len(counts.hits) > 0
    low, high = interval(counts.hits, counts.draws) if covered else (None, None)
    enough = len(counts.hits) >= _LEAST_APPROACHES
    return {
        "coverage": sum(counts.hits) / draws if covered else None,
        "low": low,
        "high": high,
        "draws": draws,
        "approaches": len(counts.hits),
        "holds": None if low is None else enough and low >= probability - 0.1 * (1.0 - probability),
        "places": sum(len(one.collisions) for one in staged),
        "not_found": sum(one.sought - len(one.collisions) for one in staged),
        "unavoidable": sum(len(one.collisions) - len(one.avoidable) for one in staged),
        "unknowable": sum(len(one.avoidable) - len(one.knowable) for one in staged),
        "alarms": counts.alarms,
        "alarm_s": counts.alarm_s,
        "alarms_per_min": 60.0 * counts.alarms / counts.judged_s if counts.judged_s else None,
        "alarm_share": counts.alarm_s / counts.judged_s if counts.judged_s else None,
        "judged_s": counts.judged_s,
    }
