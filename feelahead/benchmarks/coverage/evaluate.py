"""Everything about the cells of one motion: the approaches are recorded once and judged for every cell, law and P."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from common.arrays import FloatArray
from common.reaction import HORIZON_S, REACTION_S
from feelahead.benchmarks.coverage.cells import LINKS, Cell, Motion, Plan
from feelahead.benchmarks.coverage.collisions import Collision, first_touch_s, place
from feelahead.benchmarks.coverage.covered import false_alarms, lateness_s, stood
from feelahead.benchmarks.coverage.intervals import draws_needed, share
from feelahead.benchmarks.coverage.laws import Draw, FieldLaw, make_law
from feelahead.benchmarks.coverage.replay import Replay
from feelahead.lab.approaches.frozen import PASSED, SITE, frozen_scene
from feelahead.lab.approaches.recording import record_approach
from feelahead.lab.approaches.spoilt import Spoil
from robot_side.settings import EncoderSettings
from robot_side.simulation.camera import CameraError
from robot_side.simulation.posed_scene import PosedScene
from robot_side.simulation.scene import Scene, load_scene

_ALARM_APPROACHES = 10
"""Where a contact is ahead, false alarms are looked for in so many approaches; where none is, in all."""
_MOVING_M_S = 0.01


@dataclass(frozen=True)
class Row:
    """One cell, law and P."""

    cell: str
    scene: str
    pull: str
    link: str
    camera_mm: float
    encoder_factor: float
    law: str
    probability: float
    coverage: float | None
    """None where nothing collides, or no release avoids it."""
    low: float | None
    high: float | None
    draws: int
    approaches: int
    holds: bool | None
    late_ms: float | None
    """Median over the places: how much too late full strength stands, of those in which it does before the touch."""
    never: float | None
    """Share of the places in which it does not."""
    reported: int
    """Draws in which the operator side has a report of the drift or turn, if any, 0.25 s before the last moment."""
    reported_coverage: float | None
    """Of these alone; None without any."""
    mean_strength: float | None
    """In the zone that the finger reaches, 0.25 s before the last moment to let go."""
    places: int
    not_found: int
    """Places that were sought and not found: the approach goes past the object, or nowhere."""
    unavoidable: int
    """Places in which no release since the pull's beginning avoids the contact; not among the draws."""
    alarms_per_min: float | None
    """None where nothing was pulled."""
    alarm_share: float | None
    """Of the time in which R2 was pulled."""
    judged_s: float
    margin_mm: float | None
    """The distance of the law `margin`: how far the law swept feels on average. None where that law is left out."""


@dataclass
class _Counts:
    """Of one law at one P; `hits` and `draws` have an entry for each approach."""

    hits: list[int] = field(default_factory=list)
    draws: list[int] = field(default_factory=list)
    reported: int = 0
    reported_hits: int = 0
    strength: int = 0
    late_s: list[float] = field(default_factory=list)
    alarms: int = 0
    alarm_s: float = 0.0
    judged_s: float = 0.0


@dataclass(frozen=True)
class _Staged:
    """One approach among the objects of one cell, in every place."""

    replay: Replay
    posed: PosedScene
    collisions: tuple[Collision, ...]
    """Empty where nothing collides: the objects then stand where the scene has them."""
    sought: int
    """How many were looked for."""

    @property
    def avoidable(self) -> tuple[tuple[Collision, float], ...]:
        """Collisions that some release avoids, with the last moment for it."""
        return tuple((one, one.last_release_s) for one in self.collisions if one.last_release_s is not None)

    def draw(self, shift_m: FloatArray, cell: Cell, number: int) -> Draw:
        """The objects moved by shift_m (3,), seen with the camera's `number`-th error."""
        record, names = self.replay.record, tuple(thing.name for thing in self.posed.scene.objects)
        sd_m = 1e-3 * cell.camera_mm
        errors_m = CameraError(names, 0.0, sd_m, 0.0, _seed(record.seed, number)).next_frame()
        self.posed.put(record.joint_positions_rad[0], record.finger_positions[0], shift_m)
        return Draw(self.replay, self.posed.perceived(errors_m), sd_m, cell.speed_m_s)


def evaluate(
    motion: Motion, cells: Sequence[Cell], plan: Plan, seed: int, spoil: Spoil = "nothing"
) -> Iterator[list[Row]]:
    """The rows of each cell in turn; the same seed gives the same rows."""
    records = [
        record_approach(motion.pull, LINKS[motion.link], _seed(seed, number), scene_name=motion.home)
        for number in range(plan.approaches)
    ]
    for cell in cells:
        scene = _scene(cell.scene)
        encoder = EncoderSettings(sigma_rad=cell.encoder_factor * EncoderSettings().sigma_rad)
        staged = [_stage(cell, Replay(record, scene, encoder, record.seed), plan.places) for record in records]
        yield _evaluate_cell(cell, staged, plan, spoil)


@cache
def _scene(name: str) -> Scene:
    return load_scene(frozen_scene(name), SITE)


def _seed(approach: int, number: int) -> int:
    return int(np.random.SeedSequence([approach, number]).generate_state(1)[0] >> 1)


def _stage(cell: Cell, replay: Replay, places: int) -> _Staged:
    posed = PosedScene(_scene(cell.scene))
    if cell.scene in PASSED:
        return _Staged(replay, posed, (), 0)
    generator = np.random.default_rng([replay.record.seed, 0x71ACE])
    found = [place(replay, posed, generator, cell.speed_m_s) for _ in range(places)]
    return _Staged(replay, posed, tuple(one for one in found if one is not None), places)


def _evaluate_cell(cell: Cell, staged: Sequence[_Staged], plan: Plan, spoil: Spoil) -> list[Row]:
    rows = []
    for probability in plan.probabilities:
        replays = [one.replay for one in staged]
        margin_m = mean_way_m(replays) if "margin" in plan.laws else None
        for name in plan.laws:
            counts, law = _Counts(), make_law(name, probability, margin_m, spoil)
            _count_covered(counts, law, cell, staged, probability)
            _count_alarms(counts, law, cell, staged, probability)
            rows.append(_row(cell, name, probability, counts, staged, margin_m))
    return rows


def _count_covered(counts: _Counts, law: FieldLaw, cell: Cell, staged: Sequence[_Staged], probability: float) -> None:
    """At least n >= 10 / (1 - P) draws, as many for each approach that has a contact to avoid."""
    useful = [one for one in staged if one.avoidable]
    least = math.ceil(draws_needed(probability) / max(1, len(useful)))
    for one in useful:
        # Every place as often as any other, at each P.
        each = len(one.avoidable) * math.ceil(least / len(one.avoidable))
        hits = 0
        for number in range(each):
            collision, last_release_s = one.avoidable[number % len(one.avoidable)]
            draw = one.draw(collision.shift_m, cell, number)
            judged = stood(law, draw, last_release_s)
            hits += judged.covered
            if one.replay.knows_aside(last_release_s - REACTION_S):
                counts.reported += 1
                counts.reported_hits += judged.covered
            counts.strength += judged.strength
            if number < len(one.avoidable):
                late_s = 0.0 if judged.covered else lateness_s(law, draw, last_release_s, collision.touch_s)
                counts.late_s.append(late_s)
        counts.hits.append(hits)
        counts.draws.append(each)


def _count_alarms(counts: _Counts, law: FieldLaw, cell: Cell, staged: Sequence[_Staged], probability: float) -> None:
    passed = cell.scene in PASSED
    for one in staged if passed else staged[:_ALARM_APPROACHES]:
        places = [(at.shift_m, at.touch_s) for at in one.collisions[:1]]
        if passed:
            # A drift or a turn may touch what a straight approach passes.
            touch_s = first_touch_s(one.replay, one.posed, np.zeros(3))
            places = [(np.zeros(3), one.replay.end_s if touch_s is None else touch_s)]
        for shift_m, until_s in places:
            alarms = false_alarms(law, one.draw(shift_m, cell, 0), one.posed, shift_m, until_s, probability)
            counts.alarms += alarms.count
            counts.alarm_s += alarms.alarm_s
            counts.judged_s += alarms.judged_s


def mean_way_m(replays: Sequence[Replay]) -> float:
    """How far ahead the law swept feels on average while the tool moves: v (t_d + h) + v²/2a."""
    found = []
    for replay in replays:
        record = replay.record
        for row in range(0, len(record.pose_time_s), 5):
            speed = abs(replay.approach_speed_m_s[row])
            if speed > _MOVING_M_S:
                braking_m = speed * speed / (2.0 * replay.deceleration_m_s2(float(record.pose_time_s[row])))
                found.append(speed * (float(record.loop_age_s[row]) + HORIZON_S) + braking_m)
    return float(np.mean(found)) if found else 0.0


def _row(
    cell: Cell, law: str, probability: float, counts: _Counts, staged: Sequence[_Staged], margin_m: float | None
) -> Row:
    covered = share(counts.hits, counts.draws)
    draws = sum(counts.draws)
    return Row(
        cell=cell.key,
        scene=cell.shown,
        pull=cell.motion.pull,
        link=cell.motion.link,
        camera_mm=cell.camera_mm,
        encoder_factor=cell.encoder_factor,
        law=law,
        probability=probability,
        coverage=None if covered is None else covered.value,
        low=None if covered is None else covered.low,
        high=None if covered is None else covered.high,
        draws=draws,
        approaches=0 if covered is None else covered.approaches,
        holds=None if covered is None else covered.holds(probability),
        late_ms=1e3 * float(np.median(came)) if (came := [late for late in counts.late_s if late < math.inf]) else None,
        never=1.0 - len(came) / len(counts.late_s) if counts.late_s else None,
        reported=counts.reported,
        reported_coverage=counts.reported_hits / counts.reported if counts.reported else None,
        mean_strength=counts.strength / draws if draws else None,
        places=sum(len(one.collisions) for one in staged),
        not_found=sum(one.sought - len(one.collisions) for one in staged),
        unavoidable=sum(len(one.collisions) - len(one.avoidable) for one in staged),
        alarms_per_min=60.0 * counts.alarms / counts.judged_s if counts.judged_s else None,
        alarm_share=counts.alarm_s / counts.judged_s if counts.judged_s else None,
        judged_s=counts.judged_s,
        margin_mm=None if margin_m is None else 1e3 * margin_m,
    )
