"""From meetings to ramps: which spheres of a block meet an object, and at which way; the nearest meetings first."""

import math

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.ahead.find import TARGET, TOUCHABLE, near_rows
from robot_side.ahead.kinds.layout import HALF_SPACE, MESH
from robot_side.ahead.scene_table import SceneColumns
from robot_side.ahead.tables import BLOCK, DONE, LIMITED, NEW, PAIRS, RAMPS, STRENGTHS, WINDOW, Record, TableColumns
from robot_side.ahead.way import passes, way_to
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, load


@inlined
def _meet(
    scene: SceneColumns, tables: TableColumns, count: int, center: Vector, radius: float, along: Vector, reach: float
) -> bool:
    """Add the ramp of one sphere and the first `count` near rows of one object, if it meets any; whether it touches."""
    found = tables.progress
    first = found[PAIRS]
    start, touching = math.inf, False
    for k in range(count):
        row = tables.near[k]
        kind = scene.kinds[row]
        if kind != HALF_SPACE and not passes(center, along, reach, scene.bounds, row, radius):
            continue
        way = way_to(kind, scene.shapes, row, center, radius, along, reach)
        if way > reach:
            continue
        pair = tables.pairs[found[PAIRS]]
        # A mesh's own way is found out afterwards.
        pair.row, pair.entry, pair.again = row, math.nan if kind == MESH else way, math.inf
        found[PAIRS] += 1
        start = min(start, way)
        touching |= way == 0.0
    if found[PAIRS] == first:
        return False
    ramp = tables.ramps[found[RAMPS]]
    found[RAMPS] += 1
    ramp.first_pair, ramp.pairs, ramp.radius = first, found[PAIRS] - first, radius
    ramp.state, ramp.asked, ramp.nodes, ramp.start = NEW, 0, 0, start
    ramp.most, ramp.lean, ramp.begins, ramp.walked, ramp.level = math.inf, 0.0, start, -1, 0
    return touching


@inlined
def _next_ramp(ramps: np.ndarray, known: int) -> float:
    """Where the nearest ramp begins that something may still come of."""
    nearest = math.inf
    for k in range(known):
        if ramps[k].state != DONE:
            nearest = min(nearest, ramps[k].start - ramps[k].before)
    return nearest


@inlined
def _next_meeting(meetings: np.ndarray, count: int) -> float:
    """And the nearest meeting that has not been looked at."""
    nearest = math.inf
    for k in range(count):
        if not meetings[k].met:
            nearest = min(nearest, meetings[k].bound)
    return nearest


@inlined
def _meet_block(
    meeting: Record,
    spheres: int,
    along: Vector,
    widest: float,
    reach: float,
    standing: int,
    early: float,
    least_depth: float,
    scene: SceneColumns,
    tables: TableColumns,
) -> bool:
    """Add the ramps of one meeting; False where there is no room for them."""
    block, thing, found = meeting.block, meeting.object, tables.progress
    center, radius = load(tables.blocks, block), tables.blocks[block, 3]
    count = near_rows(scene, thing, center, radius, along, reach, tables.near)
    if found[RAMPS] + 2 * BLOCK > tables.ramps.size or found[PAIRS] + 2 * BLOCK * count > tables.pairs.size:
        return False
    meeting.met = 1
    for i in range(block * BLOCK, min((block + 1) * BLOCK, spheres)):
        inflated = tables.sigma[i, 0]
        if standing == TARGET and tables.on_finger[i] and inflated > widest:
            inflated = widest
            found[LIMITED] += 1
        for bare in range(2):
            place = found[RAMPS]
            size = tables.spheres[i, 3] + (0.0 if bare else inflated)
            touching = _meet(scene, tables, count, load(tables.spheres, i), size, along, reach)
            if found[RAMPS] > place:
                ramp = tables.ramps[place]
                ramp.sphere, ramp.object = i, thing
                ramp.least = min(math.pi * size * least_depth * least_depth, 0.5 * scene.object_volumes[thing])
                ramp.touchable = standing in (TOUCHABLE, TARGET)
                ramp.expected = inflated - min(tables.sigma[i, 1], inflated)
                ramp.bare, ramp.early, ramp.before = bare, early, early + (inflated if bare else 0.0)
            # A sphere that overlaps already may have swallowed what is ahead of it: it counts uninflated, too.
            if not touching:
                break
    return True


@inlined
def meet(
    scene: SceneColumns,
    tables: TableColumns,
    count: int,
    standing: IntArray,
    early: FloatArray,
    along: Vector,
    widest: float,
    margin: float,
    reach: float,
    least_depth: float,
    spheres: int,
) -> int:
    """Add the ramps of those of the first `count` meetings that come next; -1 where there is no room for them.

    standing (k,): what each object is; early (k,): by how much its ways are shorter. widest: half the gap between the
    fingers, the most by which a finger's sphere is inflated towards the target (§3.4), infinite without a gripper.
    A meeting beyond the slow ways so far cannot shorten any. The number left.
    """
    meetings, ramps, found, slow = tables.meetings, tables.ramps, tables.progress, tables.ways[1]
    window = WINDOW * margin
    while True:
        nearest = min(_next_ramp(ramps, found[RAMPS]), _next_meeting(meetings, count))
        left = 0
        for k in range(count):
            meeting = meetings[k]
            if meeting.met:
                continue
            if meeting.bound > 0.0 and meeting.bound - margin >= slow[STRENGTHS - 1]:
                meeting.met = 1
            elif meeting.bound > nearest + window:
                left += 1
            elif not _meet_block(
                meeting,
                spheres,
                along,
                widest,
                reach + early[meeting.object],
                standing[meeting.object],
                early[meeting.object],
                least_depth,
                scene,
                tables,
            ):
                return -1
        if left == 0 or _next_ramp(ramps, found[RAMPS]) < math.inf:
            return left
        # Blocks that turned out to meet nothing make way for the next ones, and more of these at a time.
        window *= 2.0
