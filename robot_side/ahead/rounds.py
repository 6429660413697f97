"""Round after round, the nearest first, until nothing could shorten a way any more: in one call, but for meshes.

`meet` adds the ramps that come next, `ask` writes the overlaps to be worked out at their nodes, `take` takes the
results in. Meshes have kernels of their own, which the caller runs in between.
"""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.ahead.ask import ask
from robot_side.ahead.feel import take
from robot_side.ahead.meet import meet
from robot_side.ahead.scene_table import scene_at
from robot_side.ahead.tables import (
    ASK,
    ENTERED,
    LEFT,
    MEET,
    MESH_JOBS,
    OVERLAPPED,
    RAMPS,
    ROUNDS,
    STEP,
    STRENGTHS,
    TAKE,
    WORK,
    tables_at,
)
from robot_side.ahead.total_overlap import worked_out
from robot_side.compiled.bundle import BUNDLE
from robot_side.compiled.kernel import (
    COUNT,
    NUMBER,
    TRUTH,
    compiled,
    inlined,
    input_array,
    input_indices,
)
from robot_side.compiled.vectors import load

ENDED, PAUSED, OVERLAPS, MESHES_MET, MORE_RAMPS, MORE_JOBS = 0, 1, 2, 3, 4, 5
"""What the caller has to do: nothing more; call again, at leisure; work out the jobs; fill in where ramps enter meshes;
make room."""
_MOST_ROUNDS: Final = 1000
_OF_A_MESH: Final = 10
"""A mesh costs as much as so many boxes, about."""


@inlined
def _forget_beyond(ways: FloatArray, reach: float) -> None:
    """Beyond the reach not all is known."""
    for kind in range(2):
        for strength in range(STRENGTHS):
            if ways[kind, strength] > reach:
                ways[kind, strength] = math.inf


@compiled(
    *(COUNT, COUNT, COUNT, input_array(1), NUMBER, NUMBER, NUMBER, NUMBER, TRUTH),
    *(input_indices(), input_array(1), BUNDLE, BUNDLE),
    returns=COUNT,
)
def go_on(
    most: int,
    spheres: int,
    meetings: int,
    direction: FloatArray,
    reach: float,
    margin: float,
    widest: float,
    least_depth: float,
    has_meshes: bool,
    standing: IntArray,
    early: FloatArray,
    scene_bundle: IntArray,
    tables_bundle: IntArray,
) -> int:
    """Go on with a look that `find` has begun, until the caller has to do something: what that is.

    It pauses between two rounds as soon as `most` has been done in all, as `progress[WORK]` counts it. The first
    `spheres` and `meetings` of the tables count. For the other arguments see `find` and `meet`.
    """
    scene, tables = scene_at(scene_bundle), tables_at(tables_bundle)
    along, farthest, progress = load(direction.reshape(1, 3), 0), reach + margin, tables.progress
    while progress[ROUNDS] < _MOST_ROUNDS:
        if progress[STEP] == MEET:
            if progress[WORK] >= most:
                return PAUSED
            progress[ENTERED] = progress[RAMPS]
            if progress[LEFT] != 0:
                progress[LEFT] = meet(
                    scene, tables, meetings, standing, early, along, widest, margin, farthest, least_depth, spheres
                )
            progress[WORK] += progress[RAMPS] - progress[ENTERED]
            if progress[LEFT] >= 0:
                progress[STEP] = ASK
            if has_meshes and progress[RAMPS] > progress[ENTERED]:
                return MESHES_MET
            if progress[LEFT] < 0:
                return MORE_RAMPS
        elif progress[STEP] == ASK:
            asked = ask(scene, tables, along, margin, farthest, most - progress[WORK])
            progress[STEP] = MEET if asked < 0 else TAKE
            if asked < 0:
                return MORE_JOBS
            if asked == 0 and progress[LEFT] == 0:
                break
            progress[OVERLAPPED] += tables.jobs.counts.sum()
            progress[WORK] += asked + _OF_A_MESH * tables.jobs.counts[MESH_JOBS]
            if has_meshes or not worked_out(tables.jobs):
                return OVERLAPS
        else:
            take(scene, tables, along, margin, farthest)
            progress[STEP] = MEET
            progress[ROUNDS] += 1
    _forget_beyond(tables.ways, reach)
    return ENDED
