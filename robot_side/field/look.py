"""One look along a direction in one compiled call: it finds the onset distances of the strengths (eq. 3-12, §4.2).

    inflate ─▶ broad phase: objects, clusters of spheres ─▶ contact of each sphere ─▶ overlap profiles

Best-first search: the object, cluster or sphere that may touch at the shortest distance is examined next. An overlap is
computed only where it may shorten an onset distance (`profile`).
"""

import math
from typing import Final

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.arm.port import CLUSTER
from robot_side.compiled.columns import BUNDLE
from robot_side.compiled.kernel import (
    BOOL,
    FLOAT64,
    building_block,
    compiled,
    inlined,
    input_array,
    input_flags,
    input_indices,
)
from robot_side.compiled.vectors import Vector, load
from robot_side.field.inflation import (
    ERRORS,
    DirectionalErrors,
    around_spheres,
    inflate,
    most_along,
    own_errors,
    place_spheres,
)
from robot_side.field.nearest_first import drop_first, push
from robot_side.field.object_class import SKIPPED
from robot_side.field.pairs import enter, pairs_of
from robot_side.field.profile import follow
from robot_side.field.samples import Profile
from robot_side.field.scratch import MOST_WORK, SCRATCH, STRENGTHS, Bundles, Count, Error, ScratchColumns
from robot_side.surroundings.any_kind import contact
from robot_side.surroundings.bounds import passes
from robot_side.surroundings.kinds.layout import HALF_SPACE, MESH
from robot_side.surroundings.scene_columns import SCENE, contact_with, next_object

MARGIN_M: Final = 0.012
"""Margin m: distance before the onset of full strength over which strength grows from 0"""
LEAST_DEPTH_M: Final = 0.0005
"""Depth into a sphere up to which an overlap is a graze: V_min = π R (0.5 mm)². Encoder noise diverts the motion by
less."""

scene_at, scratch_at = SCENE.at, SCRATCH.at


@inlined
def _last_to_count(scratch: ScratchColumns, margin: float) -> float:
    """Return the contact distance, lead subtracted, beyond which a contact changes no onset distance."""
    last: float = max(scratch.distances_m[0, STRENGTHS - 1], scratch.distances_m[1, STRENGTHS - 1])
    return last + margin


@inlined
def _within_budget(scratch: ScratchColumns, pairs: int) -> bool:
    """Return whether the look may go on. pairs: those of the present object, which are not counted yet."""
    within: bool = scratch.counts[Count.PAIRS] + pairs + scratch.counts[Count.OVERLAPS] <= MOST_WORK
    return within


@building_block
def _near_rows(
    bundles: Bundles, first: int, end: int, center: Vector, size: float, along: Vector, reach: float
) -> tuple[int, float]:
    """Keep those rows from `first` to before `end` whose primitives a bounding sphere touches within `reach`.

    Return the number of kept rows and the least contact distance. Meshes count as their bounding boxes.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    count, least = 0, math.inf
    for row in range(first, end):
        kind = scene.kinds[row]
        if kind == HALF_SPACE or passes(center, along, reach, scene.bounds, row, size):
            distance, _ = contact(kind, scene.shapes, row, center, size, along, reach)
            if distance <= reach:
                scratch.rows[count], least = row, min(least, distance)
                count += 1
    return count, least


@building_block
def _cluster_bound(bundles: Bundles, rows: int, cluster: int, along: Vector, reach: float) -> tuple[float, bool]:
    """Return a lower bound of `_cluster_contact`, in which meshes count as their bounding boxes.

    Also return whether any mesh came into question.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    center, radius, least, rough = load(scratch.clusters, cluster), scratch.clusters[cluster, 3], math.inf, False
    for k in range(rows):
        row, near = scratch.rows[k], min(reach, least)
        kind = scene.kinds[row]
        if kind == HALF_SPACE or passes(center, along, near, scene.bounds, row, radius):
            found, _ = contact(kind, scene.shapes, row, center, radius, along, near)
            least, rough = min(least, found), rough or kind == MESH
    return least, rough


@building_block
def _cluster_contact(bundles: Bundles, rows: int, cluster: int, along: Vector, reach: float, clear: bool) -> float:
    """Return the least distance at which a cluster's bounding sphere touches a primitive of the kept rows."""
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    center, radius, least = load(scratch.clusters, cluster), scratch.clusters[cluster, 3], math.inf
    for k in range(rows):
        row, near = scratch.rows[k], min(reach, least)
        if scene.kinds[row] == HALF_SPACE or passes(center, along, near, scene.bounds, row, radius):
            least = min(least, contact_with(scene, row, center, along, radius, near, clear)[0])
    return least


@building_block
def _follow(bundles: Bundles, item: int, rows: int, thing: int, along: Vector, reach: float, waits: bool) -> bool:
    """Set up the overlap profile of pair `item`, and do with it as `follow` does. waits: see `follow`."""
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    pair = scratch.pairs[item]
    center, end = load(scratch.spheres, pair.sphere), reach + MARGIN_M + pair.lead
    # No sample that matters lies more than a margin beyond the last distance that counts.
    entered = min(end, _last_to_count(scratch, MARGIN_M) + MARGIN_M + pair.lead)
    entries = enter(bundles, pair, rows, along, entered)
    # Each sphere counts once: an uninflated pair follows the sphere's inflated one, and those that waited come again.
    if waits and (item == 0 or scratch.pairs[item - 1].sphere != pair.sphere):
        scratch.counts[Count.ENTERED] += entries
    least = min(math.pi * pair.radius * LEAST_DEPTH_M * LEAST_DEPTH_M, 0.5 * scene.object_volumes[thing])
    return follow(Profile(pair, entries, center, along, MARGIN_M, end), least, waits, bundles)


@building_block
def _look_at(
    bundles: Bundles,
    spheres: int,
    rows: int,
    thing: int,
    object_class: int,
    lead: float,
    along: Vector,
    half_gap: float,
    reach: float,
) -> None:
    """Shorten the onset distances by one object, best first. The object's rows within the reach have been kept.

    Clusters and pairs share one queue: pair p is the item p, cluster c the item -1 - c. While only a lower bound of a
    cluster's contact is known, the cluster is the item -1 - c - (number of clusters). Pairs that wait until all others
    are done lie at the other end of the queue's array. lead: that which all pairs of the object have in common.
    """
    scratch = scratch_at(bundles.scratch)
    keys, items, count, pairs, waiting, margin = scratch.keys_m, scratch.items, 0, 0, 0, MARGIN_M
    far, nearest = reach + margin + lead, math.inf
    clusters = (spheres + CLUSTER - 1) // CLUSTER
    for cluster in range(clusters):
        bound, rough = _cluster_bound(bundles, rows, cluster, along, far)
        if bound <= far:
            item = -1 - cluster - (clusters if rough else 0)
            count = push(keys, items, count, _key(bound, lead, rough), item)
    while count > 0 and keys[0] < _last_to_count(scratch, margin) and _within_budget(scratch, pairs):
        item, first = items[0], keys[0]
        count = drop_first(keys, items, count)
        last = min(far, _last_to_count(scratch, margin) + lead)
        if item >= 0:
            if _follow(bundles, item, rows, thing, along, reach, True):
                waiting += 1
                items[items.size - waiting] = item
        elif item < -clusters:
            # Search at first only to a margin beyond the nearest cluster: most clusters are farther.
            near = min(last, max(nearest, first + lead) + margin)
            bound = _cluster_contact(bundles, rows, -1 - item - clusters, along, near, True)
            if bound <= near:
                # An overlap may rise: now meshes are tested for overlap, too.
                bound = _cluster_contact(bundles, rows, -1 - item - clusters, along, near, False)
                nearest = min(nearest, bound)
                count = push(keys, items, count, _key(bound, lead, False), item + clusters)
            elif near < last:
                count = push(keys, items, count, near - lead, item)
        else:
            clear = first > -math.inf
            for i in range((-1 - item) * CLUSTER, min(-item * CLUSTER, spheres)):
                met = pairs_of(bundles, pairs, i, rows, thing, object_class, lead, along, half_gap, last, clear)
                for place in range(pairs, pairs + met):
                    pair = scratch.pairs[place]
                    count = push(keys, items, count, pair.contact - pair.lead, place)
                pairs += met
    last = items.size - waiting
    while waiting > 0 and _within_budget(scratch, pairs):
        _follow(bundles, items[last + waiting - 1], rows, thing, along, reach, False)
        waiting -= 1
    scratch.counts[Count.PAIRS] += pairs


@inlined
def _key(bound: float, lead: float, rough: bool) -> float:
    """Return a cluster's key in the queue: its contact distance less the lead, or -∞ if it may overlap already.

    rough: whether `bound` is only a lower bound.
    """
    return bound - lead if bound > 0.0 or rough else -math.inf


@building_block
def _queue_objects(
    bundles: Bundles,
    classes: IntArray,
    approach: FloatArray,
    along: Vector,
    middle: Vector,
    size: float,
    shorter: float,
    reach: float,
) -> int:
    """Queue the objects within reach, with lower bounds of their contact distances; return their number.

    middle, size: sphere around the inflated gripper. shorter: upper bound of what shortens all contact distances.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    count, place, farthest, moves = 0, -1, reach + MARGIN_M + shorter, approach.size > 0
    for thing in range(approach.size):
        farthest = max(farthest, reach + MARGIN_M + shorter + approach[thing])
    while True:
        place = next_object(scene, place + 1, middle, along, farthest, size)
        if place >= scene.object_order.size:
            return count
        thing = scene.object_order[place]
        if classes[thing] != SKIPPED:
            first, end, lead = scene.first_rows[thing], scene.first_rows[thing + 1], shorter
            lead += approach[thing] if moves else 0.0
            rows, nearest = _near_rows(bundles, first, end, middle, size, along, reach + MARGIN_M + lead)
            if rows > 0:
                key = nearest - lead if nearest > 0.0 else -math.inf
                count = push(scratch.bounds_m, scratch.objects, count, key, thing)


@inlined
def _list_distances(scratch: ScratchColumns, reach: float) -> None:
    """Make each list of onset distances ascend: weaker strengths begin no later than stronger ones."""
    for kind in range(2):
        soonest = math.inf
        for level in range(STRENGTHS - 1, -1, -1):
            # Beyond the reach not all objects are known.
            soonest = min(soonest, scratch.distances_m[kind, level])
            scratch.distances_m[kind, level] = soonest if soonest <= reach else math.inf


@compiled(
    *(input_array(2), input_array(1), input_flags(), input_array(1), input_array(2), input_array(1), input_array(1)),
    *(ERRORS, FLOAT64, FLOAT64, input_indices(), input_array(1), input_array(2), BUNDLE, BUNDLE),
    returns=BOOL,
)
def look(
    centers: FloatArray,
    radii: FloatArray,
    on_finger: BoolArray,
    tool: FloatArray,
    jacobian: FloatArray,
    encoder_variance: FloatArray,
    direction: FloatArray,
    errors: DirectionalErrors,
    half_gap: float,
    reach: float,
    classes: IntArray,
    approach: FloatArray,
    of_objects: FloatArray,
    scene_bundle: IntArray,
    scratch_bundle: IntArray,
) -> bool:
    """Fill the scratch's onset distances. Return False for numbers that are not finite: they would compare as far away.

    centers (m, 3), radii (m,), on_finger (m,): the gripper's spheres. tool (3,), jacobian (6, n): the tool's.
    encoder_variance (n,): σ_θ². direction (3,): the unit vector û. half_gap: half the gap between the fingers, the
    largest inflation of a finger's sphere towards the target (§3.4). reach: distance examined. classes (k,): the
    objects' (`object_class`). approach (k,): distance by which each object approaches, subtracted from its contact
    distances; empty if all are at rest. errors: the largest of all objects. of_objects (k, 2): the unseen motion and
    the variance of each, in place of those in `errors`; empty if all are alike.
    """
    bundles, scene, scratch = Bundles(scene_bundle, scratch_bundle), scene_at(scene_bundle), scratch_at(scratch_bundle)
    along, margin, spheres = load(direction.reshape(1, 3), 0), MARGIN_M, radii.size
    scratch.distances_m[:], scratch.counts[:] = math.inf, 0
    finite = place_spheres(
        centers, radii, on_finger, load(tool.reshape(1, 3), 0), jacobian, encoder_variance, along, scratch
    )
    if not (inflate(errors, scratch_bundle, spheres) and finite and math.isfinite(reach + approach.sum())):
        return False
    middle, size = around_spheres(scratch.spheres, scratch.inflation_m, 0, spheres)
    differ = of_objects.size > 0
    shorter = most_along(errors) if differ else scratch.along_m[Error.ALONG]
    count = _queue_objects(bundles, classes, approach, along, middle, size, shorter, reach)
    keys, things, inflated = scratch.bounds_m, scratch.objects, errors
    while count > 0 and keys[0] < _last_to_count(scratch, margin) and _within_budget(scratch, 0):
        thing = things[0]
        count = drop_first(keys, things, count)
        own = own_errors(errors, of_objects[thing, 0], of_objects[thing, 1]) if differ else errors
        if own.unseen != inflated.unseen or own.variance != inflated.variance:
            if not inflate(own, scratch_bundle, spheres):
                return False
            inflated, (middle, size) = own, around_spheres(scratch.spheres, scratch.inflation_m, 0, spheres)
        first, end, lead = scene.first_rows[thing], scene.first_rows[thing + 1], scratch.along_m[Error.ALONG]
        lead += approach[thing] if approach.size > 0 else 0.0
        rows, _ = _near_rows(bundles, first, end, middle, size, along, reach + margin + lead)
        _look_at(bundles, spheres, rows, thing, classes[thing], lead, along, half_gap, reach)
    if differ:  # The result's D_σ are those of the largest errors.
        inflate(errors, scratch_bundle, spheres)
    if not _within_budget(scratch, 0):
        # What was not looked at may be anywhere.
        scratch.counts[Count.CUT], scratch.distances_m[:] = 1, 0.0
    _list_distances(scratch, reach)
    return True
