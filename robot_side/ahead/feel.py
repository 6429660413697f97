"""From ramps to ways: where each of the eight strengths begins (§4.2).

    W(E) = max over 0 <= E' <= E of (V(E') - V(0))⁺,   d = sup{E >= 0 : W(E) = 0}
    s(D) = min(1, W(D + m) / max(W(d + m), m |∇V(0)|, V_min))

The overlaps V(E) are worked out elsewhere, in rounds: `ask` writes the jobs of the ramps that may still matter, the
nearest first; `take` puts their results into the ramps and shortens the ways.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from robot_side.ahead.ask import NOTHING, add_to_node, ends, most_strength, room_of
from robot_side.ahead.kinds.layout import MESH
from robot_side.ahead.scene_table import SceneColumns
from robot_side.ahead.tables import (
    DONE,
    FIRST,
    GOING,
    JOB_KINDS,
    RAMPS,
    STRENGTHS,
    TOUCH_STRENGTH,
    Record,
    TableColumns,
)
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, load

_PARTS: Final = 8
"""So finely the cubic between two nodes is looked through for where a strength begins."""
_ENOUGH: Final = 1e-6
"""An overlap of so much of R³ has a tangent that is good for something."""


class _Piece(NamedTuple):
    """The overlap between two nodes: their ways, values and slopes, and what the cubic between them stays within."""

    way: float
    step: float
    volume: float
    next_volume: float
    slope: float
    next_slope: float
    low: float
    high: float


@inlined
def _piece(ramp: Record, node: int) -> _Piece:
    """What rises at both ends, or falls, has no peak in between, though the cubic may where something more is met."""
    volume, next_volume, slope, next_slope = (
        ramp.volume[node],
        ramp.volume[node + 1],
        ramp.slope[node],
        ramp.slope[node + 1],
    )
    low, high = min(volume, next_volume), max(volume, next_volume)
    if slope * next_slope < 0.0:
        low, high = -math.inf, math.inf
    way = ramp.way[node]
    return _Piece(way, ramp.way[node + 1] - way, volume, next_volume, slope, next_slope, low, high)


@inlined
def _cubic(piece: _Piece, part: float) -> float:
    """V at `part`, 0 to 1, of the way from one node to the next one, by both nodes' values and slopes."""
    rest = 1.0 - part
    value: float = (
        rest * rest * (1.0 + 2.0 * part) * piece.volume
        + part * part * (3.0 - 2.0 * part) * piece.next_volume
        + piece.step * part * rest * (rest * piece.slope - part * piece.next_slope)
    )
    return min(max(value, piece.low), piece.high)


@building_block
def _begin_to_rise(ramp: Record) -> bool:
    """Look for d between the nodes, where V first exceeds V(0); whether it does."""
    nothing = NOTHING * 4.0 / 3.0 * math.pi * ramp.radius**3
    way, excess = ramp.way[0], ramp.volume[0] - ramp.floor
    if excess > nothing:
        # It rose within a step that no rise could have needed less than: as good as there.
        ramp.free = way
        return True
    for node in range(ramp.nodes - 1):
        piece = _piece(ramp, node)
        for part in range(1, _PARTS + 1):
            share = part / _PARTS
            further = piece.way + share * piece.step
            now = _cubic(piece, share) - ramp.floor
            if now > nothing:
                # From a deficit it passes 0 in between; else it rises from where it stood.
                ramp.free = way + (further - way) * max(0.0, -excess) / (now - min(excess, 0.0))
                return True
            way, excess = further, now
    return False


@building_block
def _to_come(ramp: Record, pairs: np.ndarray) -> tuple[float, bool]:
    """The way at which the ramp's next primitive is entered, and whether the overlap may rise before that.

    What is convex and does not rise any more never does again.
    """
    last = ramp.way[ramp.nodes - 1]
    entered, may_rise = math.inf, ramp.rising > NOTHING * math.pi * ramp.radius * ramp.radius
    for k in range(ramp.first_pair, ramp.first_pair + ramp.pairs):
        comes = pairs[k].entry if pairs[k].entry > last else pairs[k].again
        if comes > last:
            entered = min(entered, comes)
        else:
            may_rise = True
    return entered, may_rise


@building_block
def _go_on(ramp: Record, pairs: np.ndarray) -> None:
    """Move the first node to where V could begin to exceed V(0), past all ways on which it surely does not."""
    last = ramp.nodes - 1
    entered, may_rise = _to_come(ramp, pairs)
    if not may_rise:
        ramp.nodes, ramp.start = 0, entered
        if entered == math.inf:
            ramp.state = DONE
        return
    # No overlap rises faster than by the sphere's disc.
    skipped = (ramp.floor - ramp.volume[last]) / (math.pi * ramp.radius * ramp.radius)
    ramp.start = ramp.way[last] + max(skipped, 0.0)
    ramp.way[0], ramp.volume[0], ramp.slope[0] = ramp.way[last], ramp.volume[last], ramp.slope[last]
    ramp.nodes = 0 if skipped > 0.0 else 1


@building_block
def _top(ramp: Record, margin: float) -> float:
    """W(d + m), the most that V exceeds V(0) by until then."""
    end = (ramp.free + margin) * (1.0 + 1e-12)
    top = 0.0
    for node in range(ramp.nodes - 1):
        piece = _piece(ramp, node)
        if piece.way > end:
            break
        if piece.way + piece.step <= end and piece.high < math.inf:
            top = max(top, piece.high - ramp.floor)
            continue
        for part in range(_PARTS + 1):
            share = part / _PARTS
            if piece.way + share * piece.step <= end:
                top = max(top, _cubic(piece, share) - ramp.floor)
    return top


@inlined
def _shorten(ramp: Record, margin: float, fast: FloatArray, slow: FloatArray) -> None:
    """Shorten the ways by what is new of one ramp."""
    if ramp.walked < 0:
        ramp.reference = max(_top(ramp, margin), margin * ramp.lean, ramp.least)
        ramp.walked, ramp.level, ramp.along, ramp.reached = 0, 0, ramp.free, 0.0
    reference, level, before, reached = ramp.reference, ramp.level, ramp.along, ramp.reached
    for node in range(ramp.walked, ramp.nodes - 1):
        piece = _piece(ramp, node)
        if level == STRENGTHS:
            break
        end = piece.way + piece.step
        if end <= ramp.free:
            continue
        rises_to = (piece.high - ramp.floor) / reference
        if node > ramp.walked and piece.way >= ramp.free and rises_to < (level + 0.5) / STRENGTHS:
            # No strength begins here.
            before, reached = end, max(reached, rises_to)
            continue
        for part in range(1, _PARTS + 1):
            share = part / _PARTS
            way = piece.way + share * piece.step
            if way <= ramp.free:
                continue
            strength = max(reached, min(1.0, (_cubic(piece, share) - ramp.floor) / reference))
            while level < STRENGTHS and strength >= (level + 0.5) / STRENGTHS:
                share_of_step = ((level + 0.5) / STRENGTHS - reached) / (strength - reached)
                found = before + share_of_step * (way - before) - margin - ramp.before
                fast[level] = min(fast[level], found)
                if not ramp.touchable:
                    slow[level] = min(slow[level], found)
                elif level < TOUCH_STRENGTH:
                    slow[level] = min(slow[level], found + ramp.expected)
                level += 1
            before, reached = way, strength
    ramp.walked, ramp.level, ramp.along, ramp.reached = ramp.nodes - 1, level, before, reached
    ramp.begins = before


@inlined
def _bound(ramp: Record, kind: int, end: float) -> None:
    """Bound what is still to come of a ramp that has one convex primitive.

    By the theorem of Brunn and Minkowski the cube root of the overlap of two convex bodies is concave along the way,
    so that the root stays below the tangent at the last node.
    """
    last = ramp.nodes - 1
    volume, slope = ramp.volume[last], ramp.slope[last]
    if ramp.pairs != 1 or kind == MESH or volume <= _ENOUGH * ramp.radius**3:
        return
    root = volume ** (1.0 / 3.0)
    steep = max(slope, 0.0) / (3.0 * root * root)
    most = root + steep * (end - ramp.way[last])
    ramp.most = max(most * most * most - ramp.floor, 0.0)
    if steep > 0.0 and ramp.level < STRENGTHS:
        needed = ramp.floor + (ramp.level + 0.5) / STRENGTHS * ramp.reference
        ramp.begins = max(ramp.begins, ramp.way[last] + (needed ** (1.0 / 3.0) - root) / steep * (1.0 - 1e-6))


@inlined
def _take_first(ramp: Record) -> None:
    """V(0) and its slope are known: the overlap grows from here, or later, or never."""
    ramp.floor = ramp.volume[0]
    ramp.lean = math.sqrt(ramp.push[0] ** 2 + ramp.push[1] ** 2 + ramp.push[2] ** 2)
    if ramp.slope[0] > NOTHING * math.pi * ramp.radius * ramp.radius:
        ramp.free = 0.0
    ramp.state = GOING


@inlined
def take(scene: SceneColumns, tables: TableColumns, along: Vector, margin: float, reach: float) -> None:
    """Put the results of the jobs into the ramps, and shorten the ways."""
    ramps, jobs, fast, slow = tables.ramps, tables.jobs, tables.ways[0], tables.ways[1]
    for kind in range(JOB_KINDS):
        first = kind * room_of(jobs)
        for job in range(first, first + jobs.counts[kind]):
            owner = jobs.owners[job]
            add_to_node(ramps[owner.ramp], owner.node, jobs.volumes[job], load(jobs.gradients, job), along)
    for k in range(tables.progress[RAMPS]):
        ramp = ramps[k]
        if ramp.asked == 0:
            continue
        ramp.nodes += ramp.asked
        ramp.asked = 0
        if ramp.state == FIRST:
            _take_first(ramp)
        if math.isnan(ramp.free) and not _begin_to_rise(ramp):
            _go_on(ramp, tables.pairs)
            if ramp.start >= reach:
                ramp.state = DONE
        elif ramp.nodes > 1:
            ended = ramp.way[ramp.nodes - 1] >= ends(ramp, margin, reach)
            if ended or ramp.way[ramp.nodes - 1] >= ramp.free + margin * (1.0 - 1e-9):
                _shorten(ramp, margin, fast, slow)
                _bound(ramp, scene.kinds[tables.pairs[ramp.first_pair].row], ends(ramp, margin, reach))
                entered, may_rise = _to_come(ramp, tables.pairs)
                full = ramp.level >= most_strength(ramp, margin)
                if full or ended or (entered == math.inf and not may_rise):
                    ramp.state = DONE
