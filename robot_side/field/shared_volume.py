"""Volume that the union of a gripper's spheres shares with the objects, which counts no space twice.

A grid of parallel lines is laid through spheres and objects. Along each line the shared length is exact: its parts in
spheres are joined, and so are its parts in objects. So only the distance between the lines makes errors: in trials at
most 1 % or 100 mm³, whichever is more (`feelahead bench felt --shared`). The lines lie askew to the world's axes, along
which most things stand: a face parallel to lines would make the largest errors.
"""

import math
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import (
    FLOAT64,
    INT64,
    building_block,
    compiled,
    inlined,
    input_array,
    input_indices,
    output_array,
    output_indices,
    tuple_type,
)
from robot_side.compiled.vectors import add, dot, load, scale, subtract
from robot_side.field.object_class import SKIPPED
from robot_side.surroundings.any_kind import nearest
from robot_side.surroundings.bounds import around, passes
from robot_side.surroundings.kinds.layout import HALF_SPACE
from robot_side.surroundings.scene_columns import SCENE, add_crossings, next_object
from robot_side.surroundings.scene_table import SceneTable

LINES: Final = 1000
"""Number of lines through the rectangle around everything that may be shared"""
_HITS: Final = 300
"""Least number of lines that shall share a length, unless that takes more than _MOST_LINES in all"""
_MOST_LINES: Final = 32_000
_MOST_CROSSINGS: Final = 512
"""Maximum number of surfaces along one line; further ones are left out"""
_ASKEW: Final[FloatArray] = np.linalg.qr([[0.51, 0.83, 0.2], [0.59, -0.31, 0.7], [0.63, -0.4, -0.6]])[0].T.copy()
"""(3, 3) frame of the grid, by rows: direction of the lines, and two axes across"""
_scene_at = SCENE.at
_NOWHERE = np.empty(0)


def shared_volume_m3(
    spheres: FloatArray,
    scene: SceneTable,
    classes: IntArray,
    of_objects_m3: FloatArray = _NOWHERE,
    step_m: float | None = None,
) -> float:
    """Return the volume in m³ that the union of spheres (m, 4), centres and radii, shares with the union of objects.

    Objects of the class SKIPPED do not count. classes (k,): the objects'. of_objects_m3 (k,), if given, is filled with
    the part of each object that is near; other entries stay. Space within several objects counts for one of them, so
    that the parts add up. step_m: distance between the lines; by default
    it follows from LINES. ValueError for a sphere that is not finite.
    """
    require_finite("spheres", spheres)
    whole = around(spheres, np.array([0, len(spheres)]))[0]
    rows, things = np.empty((2, len(scene.kinds)), dtype=np.int64)
    anchor, ends_m, touching = whole[:3], np.array([np.inf, np.inf, -np.inf, -np.inf]), np.zeros(len(spheres))
    count = int(_gather(spheres, whole, classes, scene.bundle, _ASKEW, rows, things, touching, ends_m))
    if not (ends_m[:2] < ends_m[2:]).all():
        return 0.0
    balls = _in_grid(spheres[touching > 0.0], anchor)
    # In the order of their middles along the lines, as `_join` needs them.
    balls = balls[balls[:, 0].argsort(kind="stable")]
    near, reaches = np.empty((2, len(balls) + count), dtype=np.int64), np.empty((2, len(balls) + count))
    scratch = *near, *reaches, np.empty((len(balls), 2)), np.empty((_MOST_CROSSINGS, 2))
    solids = _in_grid(scene.bounds[rows[:count]], anchor), rows[:count], things[:count], scene.bundle
    widths_m, step = ends_m[2:] - ends_m[:2], step_m or math.sqrt(float((ends_m[2:] - ends_m[:2]).prod()) / LINES)
    while True:
        ends = np.concatenate([np.floor(ends_m[:2] / step), np.ceil(ends_m[2:] / step)]).astype(np.int64)
        total_m3, hits = _sum_lines(balls, *solids, anchor, _ASKEW, ends, step, *scratch, of_objects_m3)
        # What is thin, or lies far apart, is hit by few lines.
        if step_m is not None or hits >= _HITS or widths_m.prod() > 0.25 * _MOST_LINES * step * step:
            return float(total_m3)
        step *= 0.5


def _in_grid(spheres: FloatArray, anchor: FloatArray) -> FloatArray:
    """Return spheres (n, 4) in the frame of the grid at the point `anchor`: along the lines, across (2), and radii."""
    return np.concatenate([(spheres[:, :3] - anchor) @ _ASKEW.T, spheres[:, 3:]], axis=1)


@compiled(
    *(input_array(2), input_array(1), input_indices(), BUNDLE, input_array(2)),
    *(output_indices(), output_indices(), output_array(1), output_array(1)),
    returns=INT64,
)
def _gather(
    spheres: FloatArray,
    whole: FloatArray,
    classes: IntArray,
    scene_bundle: IntArray,
    frame: FloatArray,
    rows: IntArray,
    things: IntArray,
    touching: FloatArray,
    ends: FloatArray,
) -> int:
    """Fill `rows` with the primitives that spheres may overlap, `things` with their objects; return their number.

    whole (4,): a sphere around the spheres, whose middle is the grid's. touching (m,), 0 at first: set to 1 for each
    sphere that overlaps one. ends (4,): extended to all that may be shared: low along both axes across, then high.
    """
    scene, count, nowhere = _scene_at(scene_bundle), 0, (0.0, 0.0, 0.0)
    middle, size = (whole[0], whole[1], whole[2]), whole[3]
    place = next_object(scene, 0, middle, nowhere, 0.0, size)
    while place < scene.object_order.size:
        thing = scene.object_order[place]
        place = next_object(scene, place + 1, middle, nowhere, 0.0, size)
        if classes[thing] == SKIPPED:
            continue
        for row in range(scene.first_rows[thing], scene.first_rows[thing + 1]):
            kind, counts = scene.kinds[row], False
            if kind != HALF_SPACE and not passes(middle, nowhere, 0.0, scene.bounds, row, size):
                continue
            for i in range(spheres.shape[0]):
                center, radius = load(spheres, i), spheres[i, 3]
                if kind != HALF_SPACE and not passes(center, nowhere, 0.0, scene.bounds, row, radius):
                    continue
                height, towards = nearest(kind, scene.shapes, row, center)
                if height < radius:
                    touching[i], counts = 1.0, True
                    # What they share lies beyond the tangent plane at the nearest point: in a ball around this disc.
                    height = max(height, 0.0)
                    disc, reach = (
                        subtract(add(center, scale(height, towards)), middle),
                        math.sqrt(radius**2 - height**2),
                    )
                    solid, around_it = subtract(load(scene.bounds, row), middle), scene.bounds[row, 3]
                    for k in range(2):
                        axis = load(frame, k + 1)
                        at, solid_at = dot(axis, disc), dot(axis, solid)
                        ends[k] = min(ends[k], max(at - reach, solid_at - around_it))
                        ends[2 + k] = max(ends[2 + k], min(at + reach, solid_at + around_it))
            if counts:
                rows[count], things[count] = row, thing
                count += 1
    return count


@compiled(
    *(input_array(2), input_array(2), input_indices(), input_indices(), BUNDLE, input_array(1), input_array(2)),
    *(input_indices(), FLOAT64, output_indices(), output_indices(), output_array(1), output_array(1), output_array(2)),
    *(output_array(2), output_array(1)),
    returns=tuple_type(FLOAT64, INT64),
)
def _sum_lines(
    balls: FloatArray,
    bounds: FloatArray,
    rows: IntArray,
    things: IntArray,
    scene_bundle: IntArray,
    anchor: FloatArray,
    frame: FloatArray,
    ends: IntArray,
    step: float,
    near_balls: IntArray,
    near_rows: IntArray,
    ball_reaches: FloatArray,
    row_reaches: FloatArray,
    joined: FloatArray,
    crossings: FloatArray,
    of_objects: FloatArray,
) -> tuple[float, int]:
    """Return the shared volume, the lines' shared lengths times their area, and how many lines share any.

    balls (b, 4), bounds (n, 4): spheres, and spheres around the primitives in `rows`, in the frame of the grid. ends:
    first and last numbers of lines along both axes across. near_balls to crossings: scratch. of_objects (k,) is filled
    unless it is empty.
    """
    scene, area, total, hits = _scene_at(scene_bundle), step * step, 0.0, 0
    along, aside, up = load(frame, 0), load(frame, 1), load(frame, 2)
    if of_objects.size > 0:
        for k in range(things.size):
            of_objects[things[k]] = 0.0
    for j in range(ends[1], ends[3]):
        y = (j + 0.5) * step
        some_balls = _near(balls, 2, y, near_balls, ball_reaches)
        some_rows = _near(bounds, 2, y, near_rows, row_reaches) if some_balls > 0 else 0
        if some_rows == 0:
            continue
        at_row = add((anchor[0], anchor[1], anchor[2]), scale(y, up))
        for i in range(ends[0], ends[2]):
            x = (i + 0.5) * step
            start, place, count, parts, length = add(at_row, scale(x, aside)), 0, 0, -1, 0.0
            while place < some_rows:
                thing, first = things[near_rows[place]], count
                while place < some_rows and things[near_rows[place]] == thing:
                    k = near_rows[place]
                    if (x - bounds[k, 1]) ** 2 < row_reaches[place]:
                        count = add_crossings(scene, rows[k], start, along, crossings, count)
                    place += 1
                if count == first:
                    continue
                if parts < 0:
                    parts = _join(balls, x, near_balls, ball_reaches, some_balls, joined)
                before, length = length, _shared(crossings, count, joined, parts)
                if of_objects.size > 0:
                    of_objects[thing] += area * max(length - before, 0.0)
            total += area * length
            hits += 1 if length > 0.0 else 0
    return total, hits


@inlined
def _near(balls: FloatArray, axis: int, at: float, found: IntArray, reaches: FloatArray) -> int:
    """Fill `found` with the balls that a plane across an axis cuts, `reaches` with the circles' squared radii."""
    count = 0
    for i in range(balls.shape[0]):
        reach = balls[i, 3] * balls[i, 3] - (at - balls[i, axis]) ** 2
        if reach > 0.0:
            found[count], reaches[count] = i, reach
            count += 1
    return count


@inlined
def _join(balls: FloatArray, x: float, near: IntArray, reaches: FloatArray, count: int, joined: FloatArray) -> int:
    """Fill `joined` (b, 2) with begin and end of each part of a line within balls; return the number of parts.

    The balls are in the order of their middles, so a further one can only join the last parts.
    """
    parts = 0
    for k in range(count):
        i = near[k]
        square = reaches[k] - (x - balls[i, 1]) ** 2
        if square > 0.0:
            half = math.sqrt(square)
            begin, end = balls[i, 0] - half, balls[i, 0] + half
            while parts > 0 and joined[parts - 1, 1] >= begin:
                parts -= 1
                begin, end = min(begin, joined[parts, 0]), max(end, joined[parts, 1])
            joined[parts, 0], joined[parts, 1] = begin, end
            parts += 1
    return parts


@building_block
def _shared(crossings: FloatArray, count: int, joined: FloatArray, parts: int) -> float:
    """Return the length of a line within solids and within balls; sort the first `count` crossings (n, 2)."""
    for k in range(1, count):
        at, sign, place = crossings[k, 0], crossings[k, 1], k
        while place > 0 and crossings[place - 1, 0] > at:
            crossings[place, 0], crossings[place, 1] = crossings[place - 1, 0], crossings[place - 1, 1]
            place -= 1
        crossings[place, 0], crossings[place, 1] = at, sign
    inside, entered, length = 0.0, 0.0, 0.0
    for k in range(count):
        before, inside = inside, inside + crossings[k, 1]
        if before <= 0.0 < inside:
            entered = crossings[k, 0]
        elif inside <= 0.0 < before:
            for part in range(parts):
                length += max(min(joined[part, 1], crossings[k, 0]) - max(joined[part, 0], entered), 0.0)
    return length
