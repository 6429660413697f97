"""From the gripper and the scene to meetings: D_σ of each sphere (eq. 3-10), and which blocks of spheres meet what."""

import math

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.ahead.kinds.layout import HALF_SPACE
from robot_side.ahead.scene_table import SceneColumns, next_place, scene_at
from robot_side.ahead.tables import BLOCK, begin, tables_at
from robot_side.ahead.way import passes, way_to
from robot_side.compiled.bundle import BUNDLE
from robot_side.compiled.kernel import (
    COUNT,
    NUMBER,
    building_block,
    compiled,
    inlined,
    input_array,
    input_flags,
    input_indices,
)
from robot_side.compiled.vectors import Vector, add, cross, dot, load, norm, scale, subtract

OBSTACLE, TOUCHABLE, TARGET, PASSED_OVER = 0, 1, 2, 3
"""What an object is to the field: a target is to be touched and lies between the fingers; a support is to be touched
while something is held; what is ignored or held is passed over."""


@inlined
def _joints_along(jacobian: FloatArray, encoder_variance: FloatArray, along: Vector) -> FloatArray:
    """For each joint (n, 5) û × ω, û·v and its variance."""
    joints = np.empty((encoder_variance.size, 5))
    for joint in range(encoder_variance.size):
        linear = jacobian[0, joint], jacobian[1, joint], jacobian[2, joint]
        angular = jacobian[3, joint], jacobian[4, joint], jacobian[5, joint]
        turning = cross(along, angular)
        for axis in range(3):
            joints[joint, axis] = turning[axis]
        joints[joint, 3], joints[joint, 4] = dot(along, linear), encoder_variance[joint]
    return joints


@inlined
def _variance_along(lever: Vector, joints: FloatArray) -> float:
    """ûᵀ J diag(σ²) Jᵀ û of the point at `lever` from the tool (eq. 5): û·(v + ω × r) for each joint."""
    total = 0.0
    for joint in range(joints.shape[0]):
        part = joints[joint, 3] + dot(load(joints, joint), lever)
        total += joints[joint, 4] * part * part
    return total


@building_block
def around_spheres(spheres: FloatArray, sigma: FloatArray, first: int, end: int) -> tuple[Vector, float]:
    """A sphere around the inflated spheres from `first` to `end`."""
    middle = 0.0, 0.0, 0.0
    for i in range(first, end):
        middle = add(middle, load(spheres, i))
    middle = scale(1.0 / max(end - first, 1), middle)
    radius = 0.0
    for i in range(first, end):
        radius = max(radius, norm(subtract(load(spheres, i), middle)) + spheres[i, 3] + sigma[i, 0])
    return middle, radius


@inlined
def near_rows(
    scene: SceneColumns, thing: int, center: Vector, radius: float, along: Vector, reach: float, near: IntArray
) -> int:
    """Write the rows of an object that a sphere may meet, by their bounds alone, to `near`; how many they are."""
    count = 0
    for row in range(scene.first_rows[thing], scene.first_rows[thing + 1]):
        if scene.kinds[row] == HALF_SPACE or passes(center, along, reach, scene.bounds, row, radius):
            near[count] = row
            count += 1
    return count


@inlined
def _least_way(
    scene: SceneColumns, near: IntArray, count: int, center: Vector, radius: float, along: Vector, reach: float
) -> float:
    """The way of a sphere to the nearest of the first `count` rows in `near`; infinite beyond the reach."""
    least = math.inf
    for k in range(count):
        row = near[k]
        kind = scene.kinds[row]
        if least > 0.0 and (kind == HALF_SPACE or passes(center, along, reach, scene.bounds, row, radius)):
            least = min(least, way_to(kind, scene.shapes, row, center, radius, along, reach))
    return least


@compiled(
    *(input_array(2), input_array(1), input_flags(), input_array(1), input_array(2), input_array(1), input_array(1)),
    *(NUMBER, NUMBER, NUMBER, NUMBER, input_indices(), input_array(1), NUMBER, BUNDLE, BUNDLE),
    returns=COUNT,
)
def find(
    centers: FloatArray,
    radii: FloatArray,
    on_finger: BoolArray,
    tool: FloatArray,
    jacobian: FloatArray,
    encoder_variance: FloatArray,
    direction: FloatArray,
    mean: float,
    variance: float,
    quantile: float,
    reach: float,
    standing: IntArray,
    early: FloatArray,
    earliest: float,
    scene_bundle: IntArray,
    tables_bundle: IntArray,
) -> int:
    """Fill the tables' spheres, D_σ, blocks and meetings; the number of meetings, more than fit where room is short.

    -1 for spheres, or errors, that are not finite: they would compare as far away, and silently give no warning.

    centers (m, 3), radii (m,), on_finger (m,): of the gripper's spheres. tool (3,), jacobian (6, n),
    encoder_variance (n,), direction: the unit û (3,). mean, variance: of eq. 10 along û, without the joints' part;
    quantile: Φ⁻¹(P). standing (k,): what each object is. early (k,): by how much its ways are to be shorter, as it
    comes towards the gripper; earliest: the most of these. The bundles: of `scene_at` and `tables_at`.
    """
    scene, tables = scene_at(scene_bundle), tables_at(tables_bundle)
    sigma, blocks, meetings, near = tables.sigma, tables.blocks, tables.meetings, tables.near
    spheres, along, origin = tables.spheres, load(direction.reshape(1, 3), 0), load(tool.reshape(1, 3), 0)
    size = radii.size
    for i in range(size):
        for axis in range(3):
            spheres[i, axis] = centers[i, axis]
        spheres[i, 3] = radii[i]
        tables.on_finger[i] = on_finger[i]
    # A maximum may hide what is no number.
    tables.largest[0] = 0.0
    check, joints = 0.0, _joints_along(jacobian, encoder_variance, along)
    for i in range(size):
        lever = subtract(load(spheres, i), origin)
        spread = math.sqrt(_variance_along(lever, joints) + variance)
        sigma[i, 0], sigma[i, 1] = max(0.0, mean + quantile * spread), max(0.0, mean)
        tables.largest[0] = max(tables.largest[0], sigma[i, 0])
        check += quantile * spread + mean + lever[0] + lever[1] + lever[2] + spheres[i, 3]
    if not math.isfinite(check + reach):
        return -1
    total, middle, around = (size + BLOCK - 1) // BLOCK, (0.0, 0.0, 0.0), 0.0
    for block in range(total):
        center, radius = around_spheres(spheres, sigma, block * BLOCK, min((block + 1) * BLOCK, size))
        blocks[block, 0], blocks[block, 1], blocks[block, 2], blocks[block, 3] = center[0], center[1], center[2], radius
        middle = add(middle, scale(1.0 / total, center))
    for block in range(total):
        around = max(around, norm(subtract(load(blocks, block), middle)) + blocks[block, 3])
    found = 0
    place = -1
    while True:
        place = next_place(scene.there, place + 1, middle, along, reach + earliest, around)
        if place >= scene.there.order.size:
            break
        thing = scene.there.order[place]
        farthest = reach + early[thing]
        if standing[thing] == PASSED_OVER or not passes(middle, along, farthest, scene.object_bounds, thing, around):
            continue
        count = near_rows(scene, thing, middle, around, along, farthest, near)
        for block in range(total):
            least = _least_way(scene, near, count, load(blocks, block), blocks[block, 3], along, farthest)
            if least <= farthest:
                if found < meetings.size:
                    meeting = meetings[found]
                    meeting.block, meeting.object, meeting.met = block, thing, 0
                    meeting.bound = least - early[thing]
                found += 1
    begin(tables, found)
    return found
