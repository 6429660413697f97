"""Which overlaps are to be worked out next: at the nodes of the ramps that may still matter, the nearest first."""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.kinds import half_space, sphere
from robot_side.ahead.kinds.layout import BOX, HALF_SPACE, SPHERE, TETRAHEDRON
from robot_side.ahead.scene_table import SceneColumns
from robot_side.ahead.tables import (
    BOX_JOBS,
    DONE,
    FIRST,
    GOING,
    JOB_KINDS,
    MESH_JOBS,
    NEW,
    NODES,
    RAMPS,
    STRENGTHS,
    TETRAHEDRON_JOBS,
    TOUCH_STRENGTH,
    WINDOW,
    JobColumns,
    Record,
    TableColumns,
)
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, add, dot, load, scale

_PLACES: Final = np.array([0, BOX_JOBS, TETRAHEDRON_JOBS, 0, MESH_JOBS])
"""Of each kind among the kinds of jobs."""
NOTHING: Final = 1e-9
"""Shares of the sphere's volume, and of its disc per metre of way, below which a change is rounding."""

NODES_PER_MARGIN: Final = 6
_NODES_FOR_MORE: Final = 30
"""From so many nodes on, a graze goes on in steps as long as it takes to have enough of them for its whole way."""
_ENLARGED: Final = 1.0 + 1e-6
"""What bounds a rise is enlarged by this, so that rounding never hides a strength."""


@building_block
def add_to_node(ramp: Record, node: int, volume: float, gradient: Vector, along: Vector) -> None:
    """Add one primitive's overlap to a node; only of the last node it is kept how much still rises."""
    slope = dot(gradient, along)
    ramp.volume[node] += volume
    ramp.slope[node] += slope
    if node == ramp.nodes + ramp.asked - 1:
        ramp.rising += max(0.0, slope)
    if ramp.state == FIRST:
        for axis in range(3):
            ramp.push[axis] += gradient[axis]
        if volume <= NOTHING * 4.0 / 3.0 * math.pi * ramp.radius**3:
            # It is touched at most: whether it will rise is not known yet.
            ramp.rising = math.inf


@inlined
def most_strength(ramp: Record, margin: float) -> int:
    """How many of the strengths a ramp could reach at all."""
    share = ramp.most * _ENLARGED / max(margin * ramp.lean, ramp.least)
    return STRENGTHS if share >= 1.0 else int(STRENGTHS * share + 0.5)


@inlined
def _matters(ramp: Record, fast: FloatArray, slow: FloatArray, margin: float) -> bool:
    """Whether a ramp could still shorten a way: nothing more of it is felt before it begins, less the margin."""
    strength = most_strength(ramp, margin)
    if strength == 0:
        return False
    begins: float = max(ramp.start, ramp.begins) - margin - ramp.before
    in_slow_zones: bool = begins < slow[strength - 1]
    if ramp.touchable:
        in_slow_zones = begins + ramp.expected < slow[min(strength, TOUCH_STRENGTH) - 1]
    return in_slow_zones or bool(begins < fast[strength - 1])


@inlined
def ends(ramp: Record, margin: float, reach: float) -> float:
    """So far a ramp's nodes go: to where it is full, where it begins to rise within the reach."""
    return reach if math.isnan(ramp.free) else max(reach, ramp.free + margin)


@inlined
def is_spent(ramp: Record, margin: float, reach: float) -> bool:
    """Whether a ramp has all its nodes."""
    last = ramp.nodes - 1
    return bool(
        ramp.state == GOING and (last == NODES - 1 or (last >= 0 and ramp.way[last] >= ends(ramp, margin, reach)))
    )


@building_block
def _step(ramp: Record, pairs: np.ndarray, nodes: int, last: float, margin: float, end: float) -> float:
    """How far it is from the node at `last`, of so many, to the next one."""
    short, long = margin / NODES_PER_MARGIN, 0.5 * margin
    if not ramp.free + margin <= last * (1.0 + 1e-9):
        return short
    # A graze goes on in long steps, but where it meets something more.
    if nodes > _NODES_FOR_MORE:
        return max(long, (end - last) / (NODES - nodes))
    for k in range(ramp.first_pair, ramp.first_pair + ramp.pairs):
        if max(ramp.free, last - margin) < pairs[k].entry < last + long:
            return short
    return long


@building_block
def plan(ramp: Record, pairs: np.ndarray, margin: float, reach: float) -> None:
    """Decide where the ramp's next nodes are, if it has any."""
    if ramp.state == NEW:
        ramp.state, ramp.free, ramp.floor, ramp.lean, ramp.nodes = GOING, math.nan, 0.0, 0.0, 0
        if ramp.start > 0.0:
            # Nothing overlaps before: this node is known.
            ramp.free, ramp.way[0], ramp.volume[0], ramp.slope[0], ramp.nodes = ramp.start, ramp.start, 0.0, 0.0, 1
        else:
            ramp.state, ramp.way[0], ramp.asked = FIRST, 0.0, 1
            for axis in range(3):
                ramp.push[axis] = 0.0
            return
    count = 0
    if ramp.nodes == 0:
        ramp.way[0] = last = ramp.start
        count = 1
    else:
        last = ramp.way[ramp.nodes - 1]
    end = ends(ramp, margin, reach)
    for _ in range(NODES_PER_MARGIN):
        if ramp.nodes + count < NODES and last < end:
            last += _step(ramp, pairs, ramp.nodes + count, last, margin, end)
            ramp.way[ramp.nodes + count] = last
            count += 1
    ramp.asked = count


@inlined
def write_job(
    kind: int, row: int, ramp: int, node: int, center: Vector, radius: float, shapes: FloatArray, jobs: JobColumns
) -> None:
    """Write the job of one sphere and the primitive in `row`, a box, a tetrahedron or a mesh; there must be room."""
    place = _PLACES[kind]
    free = jobs.counts[place]
    jobs.counts[place] += 1
    job = place * room_of(jobs) + free
    owner = jobs.owners[job]
    owner.ramp, owner.node, owner.row = ramp, node, row
    jobs.radii[job], jobs.volumes[job] = radius, 0.0
    for axis in range(3):
        jobs.centers[job, axis], jobs.gradients[job, axis] = center[axis], 0.0
    if kind == BOX:
        for axis in range(3):
            jobs.box_centers[free, axis] = shapes[row, axis]
            jobs.box_half_sizes[free, axis] = shapes[row, 12 + axis]
            for column in range(3):
                jobs.box_rotations[free, axis, column] = shapes[row, 3 + 3 * axis + column]
    elif kind == TETRAHEDRON:
        for corner in range(4):
            for axis in range(3):
                jobs.vertices[free, corner, axis] = shapes[row, 3 * corner + axis]


@inlined
def room_of(jobs: JobColumns) -> int:
    """How many jobs of each kind there is room for."""
    return jobs.owners.size // JOB_KINDS


@inlined
def _ask_node(
    ramp: Record,
    k: int,
    node: int,
    start: Vector,
    along: Vector,
    scene: SceneColumns,
    pairs: np.ndarray,
    jobs: JobColumns,
) -> None:
    """Work out, or write the jobs for, what the sphere of ramp `k` overlaps at one node of its way."""
    center = add(start, scale(ramp.way[node], along))
    for p in range(ramp.first_pair, ramp.first_pair + ramp.pairs):
        if pairs[p].entry > ramp.way[node]:
            continue
        row = pairs[p].row
        kind = scene.kinds[row]
        if kind == SPHERE:
            volume, gradient, _ = sphere.overlap(scene.shapes, row, center, ramp.radius)
            add_to_node(ramp, node, volume, gradient, along)
        elif kind == HALF_SPACE:
            volume, gradient, _ = half_space.overlap(scene.shapes, row, center, ramp.radius)
            add_to_node(ramp, node, volume, gradient, along)
        else:
            write_job(kind, row, k, node, center, ramp.radius, scene.shapes, jobs)


@inlined
def ask(scene: SceneColumns, tables: TableColumns, along: Vector, margin: float, reach: float, most: int) -> int:
    """Write the jobs of the next round of the ramps there are; the number of nodes asked for, -1 without room.

    Once there are `most` nodes the other ramps wait for another round. Spheres and half-spaces are worked out here, by
    their closed forms.
    """
    ramps, pairs, jobs, count = tables.ramps, tables.pairs, tables.jobs, tables.progress[RAMPS]
    fast, slow = tables.ways[0], tables.ways[1]
    jobs.counts[:] = 0
    nearest = math.inf
    for k in range(count):
        ramp = ramps[k]
        if ramp.state != DONE:
            if is_spent(ramp, margin, reach) or not _matters(ramp, fast, slow, margin):
                ramp.state = DONE
            else:
                nearest = min(nearest, ramp.start - ramp.before)
    asked = 0
    for k in range(count):
        ramp = ramps[k]
        if asked >= most and asked > 0:
            break
        if ramp.state == DONE or (ramp.state == NEW and ramp.start - ramp.before > nearest + WINDOW * margin):
            continue
        if max(jobs.counts[0], jobs.counts[1], jobs.counts[2]) + (NODES_PER_MARGIN + 1) * ramp.pairs > room_of(jobs):
            if asked == 0:
                return -1
            continue
        plan(ramp, pairs, margin, reach)
        if ramp.asked == 0:
            ramp.state = DONE
            continue
        ramp.rising = 0.0
        for node in range(ramp.nodes, ramp.nodes + ramp.asked):
            ramp.volume[node] = ramp.slope[node] = 0.0
            _ask_node(ramp, k, node, load(tables.spheres, ramp.sphere), along, scene, pairs, jobs)
        asked += ramp.asked
    return asked
