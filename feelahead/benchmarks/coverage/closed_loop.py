"""The recorded approaches once more in full physics, closed loop: does the benchmark's own reckoning hold?"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from common.errors import FeelaheadError
from feelahead.benchmarks.coverage.cells import LINKS, Cell, Motion
from feelahead.benchmarks.coverage.collisions import Collision, place
from feelahead.benchmarks.coverage.covered import stood
from feelahead.benchmarks.coverage.laws import Draw, make_law
from feelahead.benchmarks.coverage.replay import Replay
from feelahead.lab.approaches.approach import Approach, PullRun
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.laws import Law
from feelahead.lab.approaches.pulls import PULL_KINDS, make_pull
from feelahead.lab.approaches.recording import record_approach
from robot_side.objects.perceived import PerceivedObjects
from robot_side.settings import CameraSettings, EncoderSettings
from robot_side.simulation.camera import CameraError
from robot_side.simulation.posed_scene import PosedScene
from robot_side.simulation.scene import load_scene

_SCENES = ("wall", "post", "rod_5mm", "wall_45", "plate")
_LINKS = ("0 ms", "50 ms", "200 ms", "400 ms")
_KINDS = ("released early", "released late", "reacting")
_AROUND_S = 0.02
"""So much before the last moment a release must avoid the contact, and so much after it must not."""
_SETTLES_S = 1.5
_PROBABILITY = 0.99
_TOLD_NOT_FELT_N = 0.0
"""Effects are shown and do not resist: the pull stays the recorded one until the hand lets go."""


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
        own_seed = int(np.random.SeedSequence([seed, 0xC4EC, number]).generate_state(1)[0] >> 1)
        yield from _check_one(Cell(Motion(pull, link), scene), _KINDS[number % 3], own_seed)


def _check_one(cell: Cell, kind: str, seed: int) -> Iterator[Checked]:
    record = record_approach(cell.motion.pull, LINKS[cell.motion.link], seed)
    scene = load_scene(frozen_scene(cell.scene), SITE)
    posed, replay = PosedScene(scene), Replay(record, scene, EncoderSettings(), seed)
    collision = place(replay, posed, np.random.default_rng([seed, 0xC4EC]))
    if collision is None or collision.last_release_s is None:
        return
    last_s, link = collision.last_release_s, cell.motion.link
    if kind == "reacting":
        law: Law = "full" if seed % 2 else "swept"
        draw = Draw(replay, _as_perceived(posed, replay, collision, seed), CameraSettings().sd_m)
        expected = not stood(make_law(law, _PROBABILITY), draw, last_s).covered
        yield Checked(kind, law, cell.motion.pull, link, expected, _touches(cell, seed, collision, law, None))
        return
    let_go_s = last_s + (_AROUND_S if kind == "released late" else -_AROUND_S)
    if let_go_s > record.began_s:
        contact = _touches(cell, seed, collision, "none", let_go_s)
        yield Checked(kind, "none", cell.motion.pull, link, kind == "released late", contact)


def _as_perceived(posed: PosedScene, replay: Replay, collision: Collision, seed: int) -> PerceivedObjects:
    """The objects as the robot side of that seed perceives them (see `build_robot_side`)."""
    _, camera_seed = np.random.SeedSequence(seed).generate_state(2)
    names = tuple(thing.name for thing in posed.scene.objects)
    posed.put(replay.record.joint_positions_rad[0], replay.record.finger_positions[0], collision.shift_m)
    return posed.perceived(CameraError(names, 0.0, CameraSettings().sd_m, 0.0, int(camera_seed)).next_frame())


def _touches(cell: Cell, seed: int, collision: Collision, law: Law, let_go_s: float | None) -> bool:
    """Whether the closed loop touches, with a hand that lets go at `let_go_s`, or else 0.25 s after full strength."""
    approach = Approach(
        model=frozen_scene(cell.scene),
        force_n=0.0,
        strongest_n=_TOLD_NOT_FELT_N,
        link=LINKS[cell.motion.link],
        law=law,
        probability=_PROBABILITY,
        seed=seed,
    )
    run = PullRun(approach, make_pull(cell.motion.pull, seed), collision.shift_m, lets_go=let_go_s is None)
    run.arm()
    run.hands.let_go_s = let_go_s
    until_s = collision.touch_s + _SETTLES_S
    for now_s in run.go_on(until_s):
        gone_s = run.hands.let_go_s
        if gone_s is not None and now_s > gone_s + _SETTLES_S and abs(run.samples.speed_m_s[-1]) < 1e-3:
            break
    if run.disarmed_because is not None:
        raise FeelaheadError(f"{cell.key}, seed {seed}: the arm was stopped: {run.disarmed_because}")
    return run.onset is not None
