"""Recorded ticks through the law as it is and otherwise: what each tick cost, and which ways it felt."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import TriggerField
from feelahead.benchmarks.felt.hulls import Hulls
from feelahead.benchmarks.felt.recorded_ticks import Recorded, Tick, scene_of, with_cover
from feelahead.benchmarks.felt.turning import COVER_M, Turned, turned
from robot_side.ahead.law import Sensed
from robot_side.ahead.scene_table import scene_table
from robot_side.compiled.warm_up import warm_up

WAYS: Final = tuple(
    f"{side} {kind} {strength}" for side in ("R2", "L2") for kind in ("fast", "slow") for strength in ("first", "full")
)
"""What is compared: where strength begins and is full, of both triggers' fast and slow zones."""
_FULL_SLOW: Final = 3
"""What is to be touched is felt by four of the eight strengths at most."""
_CHUNK: Final = 250


@dataclass(frozen=True)
class Replayed:
    """One way of looking, over the ticks of one run."""

    how: Turned
    took_us: FloatArray
    """(t,) processor time of the law, the least of all times that the tick was gone through"""
    ways_m: FloatArray
    """(t, 8) those of WAYS; the horizon where nothing is felt"""
    horizon_m: FloatArray
    """(t,)"""
    spheres: int
    looks_per_s: float


def replay(recorded: Recorded, ways: Sequence[Turned], times: int) -> list[Replayed]:
    """Each of `ways` over the same ticks, in turns of a chunk, `times` times over; the kernels must be there."""
    warm_up()
    ticks = [_seen_by(how, recorded) for how in ways]
    count = len(recorded.ticks)
    took_s, felt = np.full((len(ways), count), math.inf), np.empty((len(ways), count, len(WAYS) + 1))
    looks = np.zeros(len(ways))
    for _ in range(times):
        laws = [how.new_law(*recorded.law) for how in ways]
        for first in range(0, count, _CHUNK):
            for number, (how, law, own) in enumerate(zip(ways, laws, ticks, strict=True)):
                with turned(how):
                    for place in range(first, min(first + _CHUNK, count)):
                        tick = own[place]
                        # A new frame is taken over as often, however one looks.
                        scene_table(tick.situation.objects)
                        began_s = time.thread_time()
                        sensed = law.sense(tick.situation, tick.now_s)
                        took_s[number, place] = min(took_s[number, place], time.thread_time() - began_s)
                        felt[number, place] = _numbers(sensed)
        looks[:] = [law.ahead.counts.fields for law in laws]
    passed_s = recorded.ticks[-1].now_s - recorded.ticks[0].now_s
    return [
        Replayed(
            how,
            1e6 * took_s[number],
            felt[number, :, :-1],
            felt[number, :, -1],
            len(ticks[number][0].situation.pose.sphere_radii_m),
            float(looks[number]) / passed_s,
        )
        for number, how in enumerate(ways)
    ]


def _seen_by(how: Turned, recorded: Recorded) -> tuple[Tick, ...]:
    """The ticks as this way of looking has them."""
    if how.cover_m != COVER_M:
        recorded = with_cover(recorded, how.cover_m)
    if not how.hulls:
        return recorded.ticks
    hulls = Hulls(scene_of(recorded.name), recorded.ticks[0].situation.objects)
    # A frame stays the same object for as long as there is no newer one.
    frames = {id(tick.situation.objects): tick.situation.objects for tick in recorded.ticks}
    seen = {key: hulls.of(frame) for key, frame in frames.items()}
    return tuple(
        replace(tick, situation=replace(tick.situation, objects=seen[id(tick.situation.objects)]))
        for tick in recorded.ticks
    )


def _numbers(sensed: Sensed) -> tuple[float, ...]:
    return *_ends(sensed.r2), *_ends(sensed.l2), sensed.horizon_m


def _ends(felt: TriggerField) -> tuple[float, ...]:
    return felt.fast_m[0], felt.fast_m[-1], felt.slow_m[0], felt.slow_m[_FULL_SLOW]
