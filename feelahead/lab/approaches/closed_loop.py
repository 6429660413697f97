"""Coverage in closed loop, in full physics: checks of the reckoning, and the time that a law costs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from statistics import median
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.errors import FeelaheadError
from feelahead.lab.approaches.approach import Approach, PullRun, time_to_goal_s
from feelahead.lab.approaches.evaluation import LINKS, mean_way_m, seed_of
from feelahead.lab.approaches.felt_by import Draw, make_law
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.judging import stood
from feelahead.lab.approaches.laws import Law
from feelahead.lab.approaches.meeting import Collision, place
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind, make_pull
from feelahead.lab.approaches.recording import record_approach
from feelahead.lab.approaches.replay import Replay
from feelahead.lab.approaches.spoilt import Spoil
from feelahead.lab.table import Row
from robot_side.objects.perceived import PerceivedObjects
from robot_side.settings import CameraSettings, EncoderSettings
from robot_side.simulation.camera import CameraError
from robot_side.simulation.posed_scene import PosedScene
from robot_side.simulation.scene import load_scene

KINDS: Final = ("released early", "released late", "reacting")
_SCENES: Final = ("wall", "post", "rod_5mm", "wall_45", "plate")
_LINKS: Final = ("0 ms", "50 ms", "200 ms", "400 ms")
_AROUND_S: Final = 0.02
"""A release this much before the last moment must avoid the contact; one this much after it must not."""
_SETTLES_S: Final = 1.5
_PROBABILITY: Final = 0.99
_NOT_FELT_N: Final = 0.0
"""Effects are shown and do not resist: the pull stays the recorded one until the hand lets go."""

RACED: Final = ("empty", "cluttered")
"""Scenes with a free corridor to the goal."""
_GOAL_M: Final = 0.25
_LIMIT_S: Final = 15.0
_RACED_LINK: Final = "200 ms"


@dataclass(frozen=True)
class Checked:
    """One approach, run again."""

    kind_of_check: str
    """released early, released late, or reacting to the law's full strength"""
    law: str
    pull: str
    link: str
    expected_contact: bool
    contact: bool


def check(first: int, count: int, seed: int) -> Iterator[Checked]:
    """Run the approaches `first` to `first + count` again: let go just in time, just too late, or by touch.

    Scene, link and kind of pull change with the number; an approach in which nothing collides is passed over.
    """
    for number in range(first, first + count):
        scene, link = _SCENES[number // 3 % len(_SCENES)], _LINKS[number // 15 % len(_LINKS)]
        pull = PULL_KINDS[number // 5 % len(PULL_KINDS)]
        yield from _check_one(scene, pull, link, KINDS[number % 3], seed_of(seed, 0xC4EC, number))


def _check_one(name: str, pull: PullKind, link: str, kind: str, seed: int) -> Iterator[Checked]:
    record = record_approach(pull, LINKS[link], seed)
    scene = load_scene(frozen_scene(name), SITE)
    posed, replay = PosedScene(scene), Replay(record, scene, EncoderSettings(), seed)
    collision = place(replay, posed, np.random.default_rng([seed, 0xC4EC]))
    if collision is None or collision.last_release_s is None:
        return
    last_s = collision.last_release_s
    law: Law = "none" if kind != "reacting" else "full" if seed % 2 else "swept"
    approach = Approach(
        model=frozen_scene(name),
        force_n=0.0,
        strongest_n=_NOT_FELT_N,
        link=LINKS[link],
        law=law,
        probability=_PROBABILITY,
        seed=seed,
    )
    if kind == "reacting":
        draw = Draw(replay, perceived_by(posed, replay, collision.shift_m, seed), CameraSettings().sd_m)
        expected = not stood(make_law(law, _PROBABILITY), draw, last_s).covered
        yield Checked(kind, law, pull, link, expected, _touches(approach, pull, collision, None))
        return
    let_go_s = last_s + (_AROUND_S if kind == "released late" else -_AROUND_S)
    if let_go_s > record.began_s:
        contact = _touches(approach, pull, collision, let_go_s)
        yield Checked(kind, law, pull, link, kind == "released late", contact)


def perceived_by(posed: PosedScene, replay: Replay, shift_m: FloatArray, seed: int) -> PerceivedObjects:
    """Perceive the objects, moved by shift_m (3,), as the robot side of that seed does (see `assemble`)."""
    _, camera_seed = np.random.SeedSequence(seed).generate_state(2)
    names = tuple(thing.name for thing in posed.scene.objects)
    posed.put(replay.record.joint_positions_rad[0], replay.record.finger_positions[0], shift_m)
    return posed.perceived(CameraError(names, 0.0, CameraSettings().sd_m, 0.0, int(camera_seed)).next_frame())


def _touches(approach: Approach, pull: PullKind, collision: Collision, let_go_s: float | None) -> bool:
    """Tell whether the closed loop touches; the hand lets go at `let_go_s`, or else 0.25 s after full strength."""
    run = PullRun(approach, make_pull(pull, approach.seed), collision.shift_m, lets_go=let_go_s is None)
    run.arm()
    run.hands.let_go_s = let_go_s
    for now_s in run.go_on(collision.touch_s + _SETTLES_S):
        gone_s = run.hands.let_go_s
        if gone_s is not None and now_s > gone_s + _SETTLES_S and abs(run.samples.rows[-1][1]) < 1e-3:
            break
    if run.disarmed_because is not None:
        raise FeelaheadError(f"{approach.model.stem}, {pull} pull: the arm was stopped: {run.disarmed_because}")
    return run.onset is not None


def race(scene: str, law: Law, seeds: Sequence[int], spoil: Spoil = "nothing") -> Row:
    """Compare the time to a goal in the free with that without haptics, for the same hands and seeds.

    The ratio is the median over the seeds, half of them with bells and half with steady pulls; None where most never
    arrive.
    """
    ratios = []
    for seed in seeds:
        free_s, felt_s = _time_s(scene, "none", seed, "nothing"), _time_s(scene, law, seed, spoil)
        if free_s is not None:
            ratios.append(felt_s / free_s if felt_s is not None else float("inf"))
    arrived, middle = sum(ratio < float("inf") for ratio in ratios), median(ratios) if ratios else float("inf")
    return {"ratio": middle if middle < float("inf") else None, "arrived": arrived, "of": len(ratios)}


@cache
def _time_s(scene: str, law: Law, seed: int, spoil: Spoil) -> float | None:
    approach = Approach(
        model=frozen_scene(scene),
        force_n=0.0,
        link=LINKS[_RACED_LINK],
        law=law,
        probability=_PROBABILITY,
        duration_s=_LIMIT_S,
        seed=seed,
        margin_m=_margin_m(seed) if law == "margin" else None,
        spoil=spoil,
    )
    return time_to_goal_s(approach, make_pull(_kind(seed), seed), _GOAL_M)


def _kind(seed: int) -> PullKind:
    return "bell" if seed % 2 else "steady"


@cache
def _margin_m(seed: int) -> float:
    """Average the distance at which the law swept is felt in this very pull."""
    scene = load_scene(frozen_scene("empty"), SITE)
    return mean_way_m([Replay(record_approach(_kind(seed), LINKS[_RACED_LINK], seed), scene, EncoderSettings(), seed)])
