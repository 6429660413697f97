"""Contact distances of a look straight from their definition (§4.2), with exact overlaps on fine grids.

    W(E) = max over 0 <= E' <= E of (V(E') - V(0))⁺,   d = sup{E >= 0 : W(E) = 0}
    s(D) = min(1, W(D + m) / max(W(d + m), m |∇V(0)|, V_min))

Obstacles of one surface are one object. Takes only inputs and constants from the compiled field. Passes over a sphere
and an object only if their distance alone proves that they shorten no contact distance.
"""

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from feelahead.lab.reference.solids import Solids
from feelahead.lab.reference.surfaces import whole_surfaces
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.look import LEAST_DEPTH_M, MARGIN_M
from robot_side.field.object_class import SKIPPED, TARGET, TOUCHABLE
from robot_side.field.scratch import STRENGTHS, TOUCH_STRENGTH
from robot_side.surroundings.perceived import PerceivedObjects

SLACK: Final = 0.02
"""Half width of a contact distance's band, as a change of strength, of 1."""
GRAZE_M: Final = 2e-3
"""Width of a band, in metres, above which any distance in it is right: a millimetre aside decides."""
_DUE: Final = (np.arange(STRENGTHS) + 0.5) / STRENGTHS + np.array([[0.0], [-SLACK], [SLACK]])
"""Shares (3, 8) of full strength at which strengths begin: as defined, early and late in the band."""
_STEP_M: Final = MARGIN_M / 20
_FINEST_M: Final = 5e-6
_HALVINGS: Final = int(np.ceil(np.log2(_STEP_M / _FINEST_M)))
_NOTHING: Final = 1e-9
"""Share of the volume of sphere or object, the smaller one, below which a rise from an overlap is rounding."""
_LEAST: Final = 1e-14
"""Share for a rise from nothing: a splinter's tip enters long before a larger share does."""
_FIRST_M: Final = 3.0 * MARGIN_M
"""Distance to which a pair is followed at first, in metres."""
_TOGETHER_M: Final = 0.5 * MARGIN_M
_BESIDE_M: Final = 1e-3
"""Margin beyond the reach, in metres, for the error of distances that only one side finds."""


@dataclass(frozen=True)
class Defined:
    """Result that a look should have."""

    onsets_m: FloatArray
    """(3, 2, 8) fast and slow: as defined, and early and late in the band; up to a millimetre beyond the reach"""
    sigma_m: float
    """Largest D_σ"""
    things: IntArray
    """(2, 8) the object that decides; -1 for none"""

    def judge(self, found_m: FloatArray, reach_m: float) -> "Judged":
        """Judge contact distances (2, 8) found with this reach; those beyond count as at the reach."""
        found_m, (onsets_m, approach_m, late_m) = np.minimum(found_m, reach_m), np.minimum(self.onsets_m, reach_m)
        grazes = late_m - approach_m > GRAZE_M
        outside_m = np.maximum(found_m - late_m, 0.0) - np.maximum(approach_m - found_m, 0.0)
        off_m = np.where(grazes, outside_m, found_m - onsets_m)
        known = ~(np.minimum(found_m, onsets_m) >= reach_m)
        return Judged(np.where(np.isnan(off_m), np.inf, off_m)[known], grazes[known])


class Judged(NamedTuple):
    """Errors of the contact distances (n,) within the reach."""

    off_m: FloatArray
    """Later above 0, earlier below; in a graze, the distance out of its band"""
    grazes: BoolArray


class _Pairs(NamedTuple):
    """Spheres and objects, a row each."""

    centers_m: FloatArray
    radii_m: FloatArray
    thing: IntArray
    sooner_m: FloatArray
    """Reduction of the distances: errors along û, the object's approach, the inflation of a bare sphere"""
    later_m: FloatArray
    """Increase of the distances in the slow list, for objects to be touched"""
    touchable: BoolArray
    bound_m: FloatArray
    """Distance before which no overlap begins"""
    before_m3: FloatArray
    """V(0)"""
    lean_m2: FloatArray
    """|∇V(0)|"""

    def rows(self, which: IntArray | BoolArray) -> "_Pairs":
        """Return some of the pairs."""
        return _Pairs._make(column[which] for column in self)

    def and_also(self, others: "_Pairs") -> "_Pairs":
        """Append other pairs."""
        return _Pairs._make(np.concatenate(both) for both in zip(self, others, strict=True))

    @property
    def first_m(self) -> FloatArray:
        """Return the least distance that each pair may have."""
        return self.bound_m - MARGIN_M - self.sooner_m


def statistical_m(pose: GripperPose, along: Along, encoder_sigma_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return inflation and D_σ along û, each (m, k) of a sphere towards each object, or (m, 1): eq. 5, 9 and 10."""
    leaning = np.einsum("a,man->mn", along.direction, pose.sphere_jacobians)
    kinematic_m2: FloatArray = leaning**2 @ encoder_sigma_rad**2
    own = np.array([[along.unseen_m, along.variance_m2]]) if along.of_objects is None else along.of_objects
    nearer_m = along.mean_m + own[:, 0]
    variance = kinematic_m2[:, None] + own[:, 1]
    inflated_m = np.maximum(0.0, nearer_m + along.quantile * np.sqrt(variance))
    spread = np.sqrt(variance + along.variance_along_m2)
    return inflated_m, np.maximum(0.0, nearer_m + along.mean_along_m + along.quantile * spread)


def defined_onsets(
    pose: GripperPose,
    objects: PerceivedObjects,
    classes: IntArray,
    along: Along,
    widest_m: float,
    encoder_sigma_rad: FloatArray,
) -> Defined:
    """Compute the result that `Ahead.look` should have for the same arguments."""
    objects, along = whole_surfaces(objects, classes, along)
    of_spheres_m = statistical_m(pose, along, encoder_sigma_rad)
    towards = len(pose.sphere_radii_m), len(classes)
    alone_m, sigma_m = (np.broadcast_to(of_m, towards) for of_m in of_spheres_m)
    along_m, expected_m = np.maximum(0.0, (sigma_m - alone_m).max(axis=0)), max(0.0, along.mean_m + along.mean_along_m)
    solids = Solids(objects)
    sphere, thing = np.nonzero(np.broadcast_to(classes != SKIPPED, towards))
    held_back = pose.sphere_on_finger[sphere] & (classes[thing] == TARGET)
    swollen_m = alone_m[sphere, thing]
    inflated_m = np.where(held_back, np.minimum(swollen_m, widest_m), swollen_m)
    approach_m = along_m[thing] + (np.zeros(len(thing)) if along.approach_m is None else along.approach_m[thing])
    swollen = _Pairs(
        centers_m=pose.sphere_centers_m[sphere],
        radii_m=pose.sphere_radii_m[sphere] + inflated_m,
        thing=thing,
        sooner_m=approach_m,
        later_m=np.maximum(inflated_m + along_m[thing] - expected_m, 0.0),
        touchable=np.isin(classes[thing], (TOUCHABLE, TARGET)),
        bound_m=np.zeros(len(thing)),
        before_m3=np.zeros(len(thing)),
        lean_m2=np.zeros(len(thing)),
    )
    look = _Look(solids, along.direction, along.reach_m + _BESIDE_M)
    near, kept = look.bounded(swollen)
    # A sphere that overlaps already may have swallowed objects ahead of it: count it uninflated, too.
    inside, inflated_m = near.before_m3 > 0.0, inflated_m[kept]
    bare = near.rows(inside)
    bare = bare._replace(radii_m=bare.radii_m - inflated_m[inside], sooner_m=bare.sooner_m + inflated_m[inside])
    bare, _ = look.bounded(bare)
    look.follow(near.and_also(bare))
    _, largest_m = statistical_m(pose, replace(along, of_objects=None), encoder_sigma_rad)
    return Defined(look.onsets_m, float(largest_m.max(initial=0.0)), look.things)


class _Look:
    """Contact distances found so far, (3, 2, 8), and the objects that decide them."""

    def __init__(self, solids: Solids, direction: FloatArray, reach_m: float) -> None:
        self.onsets_m: FloatArray = np.full((len(_DUE), 2, STRENGTHS), np.inf)
        self.things: IntArray = np.full((2, STRENGTHS), -1, dtype=np.int64)
        self._solids, self._direction, self._reach_m = solids, direction, reach_m

    def bounded(self, pairs: _Pairs) -> tuple[_Pairs, IntArray]:
        """Bound where each pair begins to overlap and compute V(0); return the pairs within reach and their rows."""
        end_m = self._reach_m + MARGIN_M + pairs.sooner_m
        bound_m = self._solids.first_touch_m(pairs.centers_m, pairs.radii_m, pairs.thing, self._direction, end_m)
        kept = np.flatnonzero(bound_m <= end_m)
        near = pairs.rows(kept)._replace(bound_m=bound_m[kept])
        before_m3, lean_m2 = np.zeros(len(kept)), np.zeros(len(kept))
        inside = np.flatnonzero(near.bound_m == 0.0)
        before_m3[inside], gradients = self._solids.overlap(
            near.centers_m[inside], near.radii_m[inside], near.thing[inside]
        )
        lean_m2[inside] = np.linalg.norm(gradients, axis=1)
        return near._replace(before_m3=before_m3, lean_m2=lean_m2), kept

    def follow(self, pairs: _Pairs) -> None:
        """Follow all pairs that may shorten a distance, the nearest first."""
        pairs = pairs.rows(np.argsort(pairs.first_m, kind="stable"))
        while (left := self._may_shorten(pairs, pairs.bound_m)).any():
            pairs = pairs.rows(left)
            nearest = pairs.first_m <= pairs.first_m[0] + _TOGETHER_M
            now, pairs = pairs.rows(nearest), pairs.rows(~nearest)
            known = self._shorten(now, np.minimum(now.bound_m + _FIRST_M, self._end_m(now)))
            again = now.rows(self._may_shorten(now, now.bound_m + _FIRST_M - MARGIN_M, known))
            if len(again.thing):
                self._shorten(again, self._end_m(again))

    def _end_m(self, pairs: _Pairs) -> FloatArray:
        """Return how far pairs must be known: up to W(d + m) of overlaps that begin at the reach."""
        return self._reach_m + 2.0 * MARGIN_M + pairs.sooner_m

    def _may_shorten(self, pairs: _Pairs, from_m: FloatArray, known: BoolArray | bool = False) -> BoolArray:
        """Return which pairs may shorten a distance beyond `from_m` (p,), unless known (p, 3, 8)."""
        least_m = (from_m - MARGIN_M - pairs.sooner_m)[:, None, None]
        fast = least_m < self.onsets_m[:, 0]
        later_m = np.where(pairs.touchable, pairs.later_m, 0.0)[:, None, None]
        slow = least_m + later_m < self.onsets_m[:, 1]
        slow[pairs.touchable, :, TOUCH_STRENGTH:] = False
        within = least_m <= self._reach_m
        shorter: BoolArray = np.any((fast | slow) & within & np.logical_not(known), axis=(1, 2))
        return shorter

    def _overlap(self, pairs: _Pairs, onsets_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return V and dV/dE of pairs at distances (p, k)."""
        moved = pairs.centers_m[:, None] + onsets_m[..., None] * self._direction
        size = onsets_m.shape[1]
        volumes, gradients = self._solids.overlap(
            moved.reshape(-1, 3), np.repeat(pairs.radii_m, size), np.repeat(pairs.thing, size)
        )
        return volumes.reshape(onsets_m.shape), (gradients @ self._direction).reshape(onsets_m.shape)

    def _shorten(self, pairs: _Pairs, until_m: FloatArray) -> BoolArray:
        """Shorten the distances by overlaps up to `until_m` (p,); return the strengths (p, 3, 8) known by then."""
        places = np.arange(len(pairs.thing))
        smaller_m3 = np.minimum(4.0 / 3.0 * np.pi * pairs.radii_m**3, self._solids.volumes_m3[pairs.thing])
        nothing_m3 = np.where(pairs.before_m3 > 0.0, _NOTHING, _LEAST) * smaller_m3
        nodes_m, volumes = self._nodes(pairs, until_m)
        risen = np.maximum.accumulate(np.maximum(volumes - pairs.before_m3[:, None], 0.0), axis=1)
        rises = risen[:, -1] > nothing_m3
        free = np.maximum(np.argmax(risen > nothing_m3[:, None], axis=1), 1)
        free_m = self._halve(pairs, nodes_m[places, free - 1], nodes_m[places, free], pairs.before_m3 + nothing_m3)
        full_m = free_m + MARGIN_M
        by_then = np.where(nodes_m <= full_m[:, None], risen, 0.0).max(axis=1)
        at_full, _ = self._overlap(pairs, full_m[:, None])
        by_then = np.maximum(by_then, at_full[:, 0] - pairs.before_m3)
        least_m3 = np.minimum(np.pi * pairs.radii_m * LEAST_DEPTH_M**2, 0.5 * self._solids.volumes_m3[pairs.thing])
        reference_m3 = np.maximum(np.maximum(by_then, MARGIN_M * pairs.lean_m2), least_m3)
        due_m3 = reference_m3[:, None, None] * _DUE
        # A reference is known only if d + m is within `until_m`.
        whole = rises & (full_m <= until_m + 1e-12)
        known: BoolArray = (risen[:, -1][:, None, None] >= due_m3) & whole[:, None, None]
        after = np.stack([(risen[:, :, None] < due_m3[:, None, row]).sum(axis=1) for row in range(len(_DUE))], axis=1)
        after = np.clip(after, 1, nodes_m.shape[1] - 1)
        low_m, high_m = (nodes_m[places[:, None, None], after - back] for back in (1, 0))
        less_m = (MARGIN_M + pairs.sooner_m)[:, None, None]
        more_m = np.where(pairs.touchable, pairs.later_m, 0.0)[:, None, None]
        for slow in (False, True):
            allowed = known.copy()
            if slow:
                allowed[pairs.touchable, :, TOUCH_STRENGTH:] = False
            shift_m = np.where(slow, more_m, 0.0) - less_m
            most_m = np.minimum(np.where(allowed, high_m + shift_m, np.inf).min(axis=0), self.onsets_m[:, int(slow)])
            which = np.nonzero(allowed & (low_m + shift_m < most_m))
            pair, row, level = which
            there_m = self._halve(pairs.rows(pair), low_m[which], high_m[which], pairs.before_m3[pair] + due_m3[which])
            for found_m, k, r, j in zip(there_m + shift_m[pair, 0, 0], pair, row, level, strict=True):
                if found_m < self.onsets_m[r, int(slow), j]:
                    self.onsets_m[r, int(slow), j] = found_m
                    if r == 0:
                        self.things[int(slow), j] = pairs.thing[k]
        return known

    def _nodes(self, pairs: _Pairs, until_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return distances (p, 2k + 1) and V there: evenly, and in between where V peaks, or in the middle."""
        steps = int(np.ceil((until_m - pairs.bound_m).max() / _STEP_M))
        even_m = pairs.bound_m[:, None] + np.linspace(0.0, 1.0, steps + 1) * (until_m - pairs.bound_m)[:, None]
        even, slopes = self._overlap(pairs, even_m)
        rising, falling = slopes[:, :-1], slopes[:, 1:]
        peaks = (rising > 0.0) & (falling < 0.0)
        share = np.where(peaks, rising / np.where(peaks, rising - falling, 1.0), 0.5)
        between_m = even_m[:, :-1] + share * np.diff(even_m, axis=1)
        between, _ = self._overlap(pairs, between_m)
        nodes_m, volumes = np.empty((len(even), 2 * steps + 1)), np.empty((len(even), 2 * steps + 1))
        nodes_m[:, ::2], nodes_m[:, 1::2], volumes[:, ::2], volumes[:, 1::2] = even_m, between_m, even, between
        return nodes_m, volumes

    def _halve(self, pairs: _Pairs, low_m: FloatArray, high_m: FloatArray, volume_m3: FloatArray) -> FloatArray:
        """Bisect to 5 µm where V reaches `volume_m3` (p,): reached at `high_m`, not at `low_m`."""
        for _ in range(_HALVINGS):
            middle_m = 0.5 * (low_m + high_m)
            volumes, _ = self._overlap(pairs, middle_m[:, None])
            there = volumes[:, 0] >= volume_m3
            low_m, high_m = np.where(there, low_m, middle_m), np.where(there, middle_m, high_m)
        return 0.5 * (low_m + high_m)
