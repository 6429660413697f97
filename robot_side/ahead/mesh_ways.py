"""Where the ramps of a round enter meshes, and where they may enter them anew. Only scenes with meshes load this."""

import math
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.ahead.kinds.mesh import Sweep, most_rise, next_touch, way
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import DONE, PAIR, RAMP, Record, Tables
from robot_side.compiled.kernel import (
    COUNT,
    NUMBER,
    building_block,
    compiled,
    inlined,
    input_array,
    input_indices,
    record_array,
)
from robot_side.compiled.vectors import Vector, add, dot, load, scale, subtract
from robot_side.overlap.meshes.mesh_kernels import MESH_ARGUMENTS, PLACED_ARGUMENTS
from robot_side.overlap.meshes.mesh_tables import MeshTables


class _Placed(NamedTuple):
    """Placed meshes as kernels read them, after the row of each primitive of the scene among them."""

    rows: IntArray
    meshes: IntArray
    positions: FloatArray
    rotations: FloatArray


_ARGUMENTS: Final = (
    *(input_array(2), input_array(1), NUMBER, record_array(RAMP), record_array(PAIR), COUNT, COUNT),
    *(input_indices(), *PLACED_ARGUMENTS, *MESH_ARGUMENTS),
)


class MeshWays:
    """The kernels of this file for one look along direction (3,); the margin over which strength grows."""

    def __init__(
        self,
        scene: SceneTable,
        tables: Tables,
        direction: FloatArray,
        reach_m: float,
        margin_m: float,
    ) -> None:
        self._tables = tables
        self._moving = tables.spheres, direction, reach_m
        self._margin_m = margin_m
        self._meshes = scene.rows_of_kind, *scene.placed_meshes

    def enter(self, new: slice) -> None:
        """Fill in the entries of all pairs with a mesh among the `new` ramps, and what follows for these."""
        tables = self._tables
        _enter(self._margin_m, *self._moving, tables.ramps, tables.pairs, new.start, new.stop, *self._meshes)

    def look_again(self, count: int) -> None:
        """Find out where the first `count` ramps may rise anew after the nodes that are being worked out."""
        _look_again(*self._moving, self._tables.ramps, self._tables.pairs, 0, count, *self._meshes)


@inlined
def _turned_back(rotation: FloatArray, vector: Vector) -> Vector:
    turned = rotation.T
    return dot(load(turned, 0), vector), dot(load(turned, 1), vector), dot(load(turned, 2), vector)


@inlined
def _sweep(placed: _Placed, place: int, start: Vector, along: Vector, radius: float, reach: float) -> Sweep:
    """The sweep in the frame of a placed mesh."""
    rotation = placed.rotations[place]
    away = subtract(start, load(placed.positions, place))
    return Sweep(_turned_back(rotation, away), _turned_back(rotation, along), radius, reach)


@building_block
def _enter_ramp(
    ramp: Record, pairs: np.ndarray, start: Vector, along: Vector, reach: float, placed: _Placed, tables: MeshTables
) -> None:
    """Fill in one ramp's entries."""
    ramp.start, ramp.most = math.inf, 0.0
    for k in range(ramp.first_pair, ramp.first_pair + ramp.pairs):
        pair = pairs[k]
        if math.isnan(pair.entry):
            place = placed.rows[pair.row]
            sweep = _sweep(placed, place, start, along, ramp.radius, reach)
            pair.entry = pair.again = way(tables, placed.meshes[place], sweep)
        else:
            ramp.most = math.inf
        ramp.start = min(ramp.start, pair.entry)


@building_block
def _bound_rise(
    ramp: Record,
    pairs: np.ndarray,
    start: Vector,
    along: Vector,
    reach: float,
    margin: float,
    placed: _Placed,
    tables: MeshTables,
) -> None:
    """Bound the rise of a ramp by those of its meshes, as far as that says which strengths it reaches."""
    # What V(0) leans by is not known yet; it is at most the sphere's disc.
    lean = math.pi * ramp.radius * ramp.radius if ramp.start == 0.0 else 0.0
    enough = max(ramp.least, margin * lean)
    for k in range(ramp.first_pair, ramp.first_pair + ramp.pairs):
        if pairs[k].entry <= reach and ramp.most < enough:
            place = placed.rows[pairs[k].row]
            sweep = _sweep(placed, place, start, along, ramp.radius, reach)
            ramp.most += most_rise(tables, placed.meshes[place], sweep, enough - ramp.most)


@compiled(NUMBER, *_ARGUMENTS)
def _enter(
    margin: float,
    spheres: FloatArray,
    direction: FloatArray,
    reach: float,
    ramps: np.ndarray,
    pairs: np.ndarray,
    begin: int,
    end: int,
    rows: IntArray,
    index: IntArray,
    positions: FloatArray,
    rotations: FloatArray,
    triangles: FloatArray,
    balls: FloatArray,
    boxes: FloatArray,
    links: IntArray,
    moments: FloatArray,
    roots: IntArray,
    mesh_volumes: FloatArray,
) -> None:
    """Fill in the entries of the ramps from `begin` to `end`."""
    tables = MeshTables(triangles, balls, boxes, links, moments, roots, mesh_volumes)
    placed = _Placed(rows, index, positions, rotations)
    along = load(direction.reshape(1, 3), 0)
    for k in range(begin, end):
        ramp = ramps[k]
        start = load(spheres, ramp.sphere)
        _enter_ramp(ramp, pairs, start, along, reach + ramp.early, placed, tables)
        # The uninflated sphere, which comes next, counts only beside one that overlaps already.
        if ramp.start == math.inf or (ramp.bare and ramps[k - 1].start > 0.0):
            ramp.state = DONE
        else:
            _bound_rise(ramp, pairs, start, along, reach + ramp.early, margin, placed, tables)


@compiled(*_ARGUMENTS)
def _look_again(
    spheres: FloatArray,
    direction: FloatArray,
    reach: float,
    ramps: np.ndarray,
    pairs: np.ndarray,
    begin: int,
    end: int,
    rows: IntArray,
    index: IntArray,
    positions: FloatArray,
    rotations: FloatArray,
    triangles: FloatArray,
    balls: FloatArray,
    boxes: FloatArray,
    links: IntArray,
    moments: FloatArray,
    roots: IntArray,
    mesh_volumes: FloatArray,
) -> None:
    """Find out where the ramps from `begin` to `end` may rise anew."""
    tables = MeshTables(triangles, balls, boxes, links, moments, roots, mesh_volumes)
    placed = _Placed(rows, index, positions, rotations)
    along = load(direction.reshape(1, 3), 0)
    for k in range(begin, end):
        ramp = ramps[k]
        if ramp.state == DONE or ramp.asked == 0:
            continue
        last = ramp.way[ramp.nodes + ramp.asked - 1]
        for p in range(ramp.first_pair, ramp.first_pair + ramp.pairs):
            pair = pairs[p]
            # Where it was infinite it stays so.
            if pair.entry <= last and pair.again <= last:
                place = placed.rows[pair.row]
                start = add(load(spheres, ramp.sphere), scale(last, along))
                left = _sweep(placed, place, start, along, ramp.radius, reach + ramp.early - last)
                pair.again = last + next_touch(tables, placed.meshes[place], left)
