"""Pairs of one gripper sphere and one object: their contact distance, and the primitives that the sphere enters."""

import math
from typing import Any, Final

from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, load
from robot_side.field.near_rows import next_row
from robot_side.field.object_class import TARGET, TOUCHABLE
from robot_side.field.scratch import SCRATCH, Bundles, Count, Error
from robot_side.surroundings.kinds.layout import Contact
from robot_side.surroundings.scene_columns import SCENE, contact_with

_ROUNDED: Final = 5e-3
"""Largest error of û·n at a contact, where rounding may have chosen another nearest point"""

scene_at, scratch_at = SCENE.at, SCRATCH.at


@building_block
def _meet_sphere(
    bundles: Bundles, i: int, rows: int, radius: float, along: Vector, reach: float, clear: bool
) -> Contact:
    """Return the first contact of gripper sphere `i`, with this radius, with a primitive of the first `rows` kept rows.

    clear: the sphere is known not to overlap any of them yet.
    """
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    least, least_closing, center = math.inf, 0.0, load(scratch.spheres, i)
    place = next_row(scene, scratch, 0, rows, center, along, reach, radius)
    while place < rows and least > 0.0:
        found, closing = contact_with(scene, scratch.rows[place], center, along, radius, min(reach, least), clear)
        if found < least:
            least, least_closing = found, closing
        place = next_row(scene, scratch, place + 1, rows, center, along, min(reach, least), radius)
    return least, least_closing


@building_block
def _pair(
    bundles: Bundles,
    place: int,
    i: int,
    uninflated: bool,
    rows: int,
    thing: int,
    object_class: int,
    lead: float,
    along: Vector,
    half_gap: float,
    reach: float,
    clear: bool,
) -> Any:
    """Write and return the pair of gripper sphere `i` and object `thing`, in row `place` of the scratch's pairs.

    The contact is infinite if they do not touch within the reach. uninflated: the sphere keeps its own radius, and the
    inflation becomes part of the lead instead. lead: that which all pairs of the object have in common.
    """
    scratch = scratch_at(bundles.scratch)
    pair, inflated = scratch.pairs[place], scratch.inflation_m[i, 0]
    if object_class == TARGET and scratch.on_finger[i] and inflated > half_gap:
        inflated = half_gap
        scratch.counts[Count.LIMITED] += 1 if not uninflated else 0
    own_lead = inflated if uninflated else 0.0
    pair.sphere, pair.object, pair.radius = i, thing, scratch.spheres[i, 3] + inflated - own_lead
    pair.lead, pair.touchable = lead + own_lead, object_class in (TOUCHABLE, TARGET)
    whole = inflated + scratch.along_m[Error.ALONG]
    pair.expected = max(whole - scratch.along_m[Error.EXPECTED], 0.0) if pair.touchable else 0.0
    pair.contact, pair.closing = _meet_sphere(bundles, i, rows, pair.radius, along, reach + own_lead, clear)
    pair.overlaps = pair.contact == 0.0
    return pair


@inlined
def _write_entry(entry: Any, row: int, enters: float, closing: float) -> None:
    """Write an entry that has no samples and no tangents yet."""
    entry.row, entry.enters, entry.again, entry.volume, entry.slope = row, enters, math.inf, 0.0, 0.0
    entry.closing = min(closing + _ROUNDED, 1.0) if closing > 0.0 else 0.0
    entry.root_0, entry.root_1 = math.inf, math.inf
    entry.at_0, entry.at_1, entry.steep_0, entry.steep_1 = 0.0, 0.0, 0.0, 0.0


@building_block
def enter(bundles: Bundles, pair: Any, rows: int, along: Vector, reach: float) -> int:
    """Write an entry for each kept row whose primitive the pair's sphere enters within `reach`; return their number."""
    scene, scratch = scene_at(bundles.scene), scratch_at(bundles.scratch)
    if rows == 1:
        _write_entry(scratch.entries[0], scratch.rows[0], pair.contact, pair.closing)
        return 1
    count, center = 0, load(scratch.spheres, pair.sphere)
    place = next_row(scene, scratch, 0, rows, center, along, reach, pair.radius)
    while place < rows:
        row = scratch.rows[place]
        enters, closing = contact_with(scene, row, center, along, pair.radius, reach, not pair.overlaps)
        if enters <= reach:
            _write_entry(scratch.entries[count], row, enters, closing)
            count += 1
        place = next_row(scene, scratch, place + 1, rows, center, along, reach, pair.radius)
    return count


@building_block
def pairs_of(
    bundles: Bundles,
    place: int,
    i: int,
    rows: int,
    thing: int,
    object_class: int,
    lead: float,
    along: Vector,
    half_gap: float,
    reach: float,
    clear: bool,
) -> int:
    """Write the pair of a sphere and an object, if they touch within the reach; return the number of pairs, 0 to 2.

    An inflated sphere that overlaps the object already gets a second pair, in which it is not inflated.
    """
    found = 0
    for uninflated in (False, True):
        pair = _pair(
            bundles, place + found, i, uninflated, rows, thing, object_class, lead, along, half_gap, reach, clear
        )
        found += 1 if pair.contact < math.inf else 0
        # An inflated sphere that overlaps may contain the whole object: the uninflated sphere may still touch it ahead.
        if not pair.overlaps:
            break
    return found
