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
    inflate,
    inflate_all,
    inflate_sphere,
    most_along,
    place_spheres,
)
from robot_side.field.near_rows import FEW, bound_of, cluster_contact
from robot_side.field.nearest_first import drop_first, push
from robot_side.field.pairs import enter, pairs_of
from robot_side.field.profile import follow
from robot_side.field.samples import Profile
from robot_side.field.scratch import MOST_WORK, PART, SCRATCH, STRENGTHS, Bundles, Count, Error, ScratchColumns
from robot_side.field.surfaces import approach_of, begin_surfaces, errors_of, keep_pieces, queue_objects
from robot_side.surroundings.kinds.layout import MESH
from robot_side.surroundings.scene_columns import SCENE

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
def _last_contact(scratch: ScratchColumns, far: float, lead: float) -> float:
    """Return the contact distance beyond which no contact of the present object counts, at most `far`.

    What is overlapped already counts always: there the uninflated spheres have more lead.
    """
    return max(min(far, _last_to_count(scratch, MARGIN_M) + lead), 0.0)


@inlined
def _within_budget(scratch: ScratchColumns, pairs: int) -> bool:
    """Return whether the look may go on. pairs: those of the present object, which are not counted yet."""
    within: bool = scratch.counts[Count.PAIRS] + pairs + scratch.counts[Count.OVERLAPS] <= MOST_WORK
    return within


@building_block
def _follow(bundles: Bundles, item: int, rows: int, volume: float, along: Vector, reach: float, waits: bool) -> bool:
    """Set up the overlap profile of pair `item`, and do with it as `follow` does.

    volume: the object's. waits: see `follow`.
    """
    scratch = scratch_at(bundles.scratch)
    pair = scratch.pairs[item]
    center, end = load(scratch.spheres, pair.sphere), reach + MARGIN_M + pair.lead
    # No sample that matters lies more than a margin beyond the last distance that counts.
    entered = min(end, _last_to_count(scratch, MARGIN_M) + pair.lead) + MARGIN_M
    entries = enter(bundles, pair, rows, along, entered)
    # Each sphere counts once: an uninflated pair follows the sphere's inflated one, and those that waited come again.
    if waits and (item == 0 or scratch.pairs[item - 1].sphere != pair.sphere):
        scratch.counts[Count.ENTERED] += entries
    least = min(math.pi * pair.radius * LEAST_DEPTH_M * LEAST_DEPTH_M, 0.5 * volume)
    return follow(Profile(pair, entries, center, along, MARGIN_M, end), least, waits, bundles)


@building_block
def _look_at(
    bundles: Bundles,
    spheres: int,
    rows: int,
    volume: float,
    thing: int,
    object_class: int,
    lead: float,
    along: Vector,
    half_gap: float,
    reach: float,
    errors: DirectionalErrors,
) -> None:
    """Shorten the onset distances by one object, best first. The object's rows within the reach have been kept.

    Parts, clusters and pairs share one queue: pair p is the item p, cluster c the item -1 - c. While only a lower bound
    of a cluster's contact is known, the cluster is the item -1 - c - (number of clusters). A part is an item beyond
    these. Pairs that wait until all others are done lie at the other end of the queue's array. volume: the object's.
    lead: that which all pairs of the object have in common. errors: those of the object.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    keys, items, count, pairs, waiting, margin = scratch.keys_m, scratch.items, 0, 0, 0, MARGIN_M
    far, nearest = reach + margin + lead, math.inf
    clusters, last = (spheres + CLUSTER - 1) // CLUSTER, _last_contact(scratch, far, lead)
    for part in range((spheres + PART - 1) // PART):
        bound, _ = bound_of(bundles, rows, scratch.parts, part, along, last, True)
        if bound <= last:
            count = push(keys, items, count, _key(bound, lead, scene.kernels[MESH] != 0), -1 - part - 2 * clusters)
    while count > 0 and keys[0] < _last_to_count(scratch, margin) and _within_budget(scratch, pairs):
        item, first = items[0], keys[0]
        count = drop_first(keys, items, count)
        last = _last_contact(scratch, far, lead)
        if item >= 0:
            if _follow(bundles, item, rows, volume, along, reach, True):
                waiting += 1
                items[items.size - waiting] = item
        elif item < -2 * clusters:
            count = _queue_clusters(bundles, count, -1 - item - 2 * clusters, clusters, rows, lead, along, last)
        elif item < -clusters:
            count, nearest = _queue_cluster(
                bundles, count, item + clusters, item, rows, nearest, first, lead, along, last
            )
        else:
            clear = first > -math.inf
            for i in range((-1 - item) * CLUSTER, min(-item * CLUSTER, spheres)):
                inflate_sphere(errors, scratch, i)
                met = pairs_of(bundles, pairs, i, rows, thing, object_class, lead, along, half_gap, last, clear)
                for place in range(pairs, pairs + met):
                    pair = scratch.pairs[place]
                    count = push(keys, items, count, pair.contact - pair.lead, place)
                pairs += met
    last = items.size - waiting
    while waiting > 0 and _within_budget(scratch, pairs):
        _follow(bundles, items[last + waiting - 1], rows, volume, along, reach, False)
        waiting -= 1
    scratch.counts[Count.PAIRS] += pairs


@building_block
def _queue_clusters(
    bundles: Bundles, count: int, part: int, clusters: int, rows: int, lead: float, along: Vector, last: float
) -> int:
    """Queue the clusters of a part that may touch within the distance `last`; return the new count."""
    scene, scratch, each = scene_at(bundles.scene), scratch_at(bundles.scratch), PART // CLUSTER
    for cluster in range(part * each, min((part + 1) * each, clusters)):
        bound, rough = bound_of(bundles, rows, scratch.clusters, cluster, along, last, rows > FEW)
        if bound <= last:
            item = -1 - cluster - (clusters if rough else 0)
            key = _key(bound, lead, rough and scene.kernels[MESH] != 0)
            count = push(scratch.keys_m, scratch.items, count, key, item)
    return count


@building_block
def _queue_cluster(
    bundles: Bundles,
    count: int,
    item: int,
    again: int,
    rows: int,
    nearest: float,
    first: float,
    lead: float,
    along: Vector,
    last: float,
) -> tuple[int, float]:
    """Queue a cluster, so far known by the bound `first`, with its contact; return the new count and nearest contact.

    item: the cluster's once its contact is known; again: as long as it is not.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    # Search at first only to a margin beyond the nearest cluster: most clusters are farther.
    near = min(last, max(nearest, first + lead) + MARGIN_M)
    bound = cluster_contact(bundles, rows, -1 - item, along, near, True)
    if bound <= near:
        if scene.kernels[MESH] != 0:
            # An overlap may rise: now meshes are tested for overlap, too.
            bound = cluster_contact(bundles, rows, -1 - item, along, near, False)
        return push(scratch.keys_m, scratch.items, count, _key(bound, lead, False), item), min(nearest, bound)
    if near < last:
        count = push(scratch.keys_m, scratch.items, count, near - lead, again)
    return count, nearest


@inlined
def _key(bound: float, lead: float, rough: bool) -> float:
    """Return a cluster's key in the queue: its contact distance less the lead, or -∞ if it may overlap already.

    rough: whether the bound is too rough to tell, as a mesh's.
    """
    return bound - lead if bound > 0.0 or rough else -math.inf


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
    *(ERRORS, FLOAT64, FLOAT64, input_indices(), input_array(1), input_array(2), BOOL, BUNDLE, BUNDLE),
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
    full_only: bool,
    scene_bundle: IntArray,
    scratch_bundle: IntArray,
) -> bool:
    """Fill the scratch's onset distances. Return False for numbers that are not finite: they would compare as far away.

    centers (m, 3), radii (m,), on_finger (m,): the gripper's spheres. tool (3,), jacobian (6, n): the tool's.
    encoder_variance (n,): σ_θ². direction (3,): the unit vector û. half_gap: half the gap between the fingers, the
    largest inflation of a finger's sphere towards the target (§3.4). reach: distance examined. classes (k,): the
    objects' (`object_class`). approach (k,): distance by which each object approaches, subtracted from its contact
    distances; empty if all are at rest. errors: the largest of all objects. of_objects (k, 2): the unseen motion and
    the variance of each, in place of those in `errors`; empty if all are alike. full_only: look for full strength
    alone; the others' onset distances are then -∞.
    """
    bundles, scratch = Bundles(scene_bundle, scratch_bundle), scratch_at(scratch_bundle)
    along, margin, spheres = load(direction.reshape(1, 3), 0), MARGIN_M, radii.size
    scratch.distances_m[:], scratch.counts[:] = math.inf, 0
    if full_only:
        # No onset can be sooner, so none is looked for.
        scratch.distances_m[:, : STRENGTHS - 1] = -math.inf
    finite = place_spheres(
        centers, radii, on_finger, load(tool.reshape(1, 3), 0), jacobian, encoder_variance, along, scratch_bundle
    )
    if not (inflate_all(errors, scratch_bundle, spheres) and finite and math.isfinite(reach + approach.sum())):
        return False
    middle, size = load(scratch.whole, 0), scratch.whole[0, 3]
    differ = of_objects.size > 0
    shorter = most_along(errors) if differ else scratch.along_m[Error.ALONG]
    begin_surfaces(bundles, classes, errors.quantile >= 0.0, approach, of_objects)
    count = queue_objects(bundles, classes, approach, along, middle, size, spheres, shorter, reach + 2.0 * margin)
    keys, things, inflated = scratch.bounds_m, scratch.objects, errors
    while count > 0 and keys[0] < _last_to_count(scratch, margin) and _within_budget(scratch, 0):
        again, overlaps = things[0] < 0, keys[0] <= 0.0
        entered, limited = scratch.counts[Count.ENTERED], scratch.counts[Count.LIMITED]
        thing = -1 - things[0] if again else things[0]
        # An object that never gives full strength, as one beside the gripper, would be followed all the way.
        examined = min(reach, 2.0 * margin) if overlaps else reach
        count = drop_first(keys, things, count)
        own = errors_of(bundles, thing, classes, errors, of_objects) if differ else errors
        if own.unseen != inflated.unseen or own.variance != inflated.variance:
            if not inflate(own, scratch_bundle, spheres):
                return False
            inflated = own
        lead = scratch.along_m[Error.ALONG] + approach_of(bundles, thing, classes, approach)
        rows, volume = keep_pieces(bundles, thing, classes, middle, size, along, examined + 2.0 * margin + lead)
        _look_at(bundles, spheres, rows, volume, thing, classes[thing], lead, along, half_gap, examined, inflated)
        if again:
            # These were counted before.
            scratch.counts[Count.ENTERED], scratch.counts[Count.LIMITED] = entered, limited
        elif examined < reach and _last_to_count(scratch, 0.0) > examined:
            count = push(keys, things, count, examined + margin, -1 - thing)
    if not _within_budget(scratch, 0):
        # What was not looked at may be anywhere.
        scratch.counts[Count.CUT], scratch.distances_m[:] = 1, 0.0
    _list_distances(scratch, reach)
    return True
