"""From overlaps to the stiffness of the two triggers and the rumble (§4.2, and what each role counts).

Trigger k moves sphere i along the unit vector û_ik. Its stiffness is the overlap in its way, as a share of a
reference volume: s_k = clip(Σ_ij V_ij a_ijk / V_ref, 0, 1), V_ref = f Σ_i V_i, with the alignment a_ijk from
`alignments`. Roles bend that sum: the target's part is capped, a support counts beyond its value at arming.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.alignment import alignments, trust
from robot_side.overlapping import Overlaps, by_object, select
from robot_side.perceived_objects import Role

_TRIGGERS = ("l2", "r2")
_UNIT_TOLERANCE = 1e-6
_SMALLEST = 1e-300
"""Stands for 0 in a divisor, where the quotient is limited."""

_Felt = tuple[IntArray, FloatArray, FloatArray, bool, int]
"""Objects (a,), their shares (a, 3), what the detent adds (2,), whether the target was capped, pairs blended."""
_NOTHING: _Felt = np.empty(0, dtype=np.int64), np.empty((0, 3)), np.zeros(2), False, 0


@dataclass(frozen=True)
class StiffnessSettings:
    """How overlap becomes stiffness. ConfigurationError for a value out of range."""

    mode: Literal["directional", "total"] = "directional"
    """`total`: every overlap counts in full on both triggers (the paper's one degree of freedom)."""
    reference: Literal["plane", "fraction"] = "plane"
    """Which overlap gives s = 1: that with a plane which the gripper just touches (`plane_overlaps`), whatever the
    enlargement is, or a fixed share of the enlarged gripper."""
    reference_fraction: float = 0.05
    """f: that share, for `fraction`."""
    gradient_threshold: float = 1e-3
    """The share of πR² below which a gradient is too weak to give the direction alone."""
    inside_margin: float = 0.1
    """Share of R outside a surface over which a centre passes from counting as outside to counting as inside."""
    target_cap: float = 0.5
    """The most that the target adds to a trigger, its detent included."""
    detent_step: float = 0.15
    """The step at predicted contact with the target: just-noticeable differences of stiffness are 6-15 %."""
    detent_engage_m: float = 0.001
    """The unenlarged gripper is this near the target, or nearer: contact is predicted."""
    detent_release_m: float = 0.003
    """It is farther than this again: the detent is ready for the next contact."""
    rise_per_s: float = 50.0
    """0 to 1 in 20 ms: fast against a voluntary reaction (300 ms), slow against the tick."""
    fall_per_s: float = 25.0
    """1 to 0 in 40 ms: slower than it rises, so that a noisy overlap does not rattle."""
    rumble: bool = True
    """Rumble for danger that lies along neither trigger."""

    def __post_init__(self) -> None:
        for name, choices in (("mode", ("directional", "total")), ("reference", ("plane", "fraction"))):
            if getattr(self, name) not in choices:
                raise ConfigurationError(f"{name} = {getattr(self, name)!r} is unknown; valid: {', '.join(choices)}")
        for name, lowest, highest in (
            ("reference_fraction", 1e-9, 1.0),
            ("gradient_threshold", 1e-9, 1.0),
            ("inside_margin", 1e-9, 1.0),
            ("target_cap", 0.0, 1.0),
            ("detent_step", 0.0, self.target_cap),
            ("detent_engage_m", 0.0, self.detent_release_m),
            ("detent_release_m", 0.0, 1.0),
            ("rise_per_s", 1.0, 1e6),
            ("fall_per_s", 1.0, 1e6),
        ):
            value = getattr(self, name)
            if not lowest <= value <= highest:
                raise ConfigurationError(f"{name} = {value} is out of range; valid: {lowest} to {highest}")


@dataclass(frozen=True)
class Stiffness:
    """What one update gives."""

    l2: float
    """0 to 1, after the rate limit"""
    r2: float
    rumble: float
    object_index: IntArray
    """(a,) the objects that overlap the enlarged gripper"""
    contributions: FloatArray
    """(a, 3) what each adds to l2, r2 and rumble once its role is applied, without the detent"""
    detent_engaged: bool
    target_capped: bool
    rate_limited: bool
    pairs_counted: int
    """Pairs of a sphere and an object that overlap."""
    pairs_blended: int
    """Of these, with a gradient too weak to give the direction alone."""
    pairs_inside: int
    """Of these, with the sphere's centre inside the object."""


class StiffnessMap:
    """Overlap to stiffness, with what it has to remember: baseline, detent and the last output."""

    def __init__(self, settings: StiffnessSettings) -> None:
        self.settings = settings
        self._baseline: dict[int, FloatArray] = {}
        self._supports: dict[int, FloatArray] | None = None
        self._detent_engaged = False
        self._last: tuple[float, FloatArray] | None = None

    def set_support_baseline(self) -> None:
        """From now on each support counts only beyond its value at the last update: call it on arming.

        Until the first call supports count in full. RuntimeError before the first update.
        """
        if self._supports is None:
            raise RuntimeError("set_support_baseline was called before the first update")
        self._baseline = self._supports

    def update(
        self,
        overlaps: Overlaps,
        roles: Sequence[Role],
        enlarged_volumes_m3: FloatArray,
        trigger_directions: Mapping[str, FloatArray],
        now_s: float,
        *,
        reference_m3: FloatArray | None = None,
        unenlarged_radii_m: FloatArray | None = None,
        excluded_objects: Collection[int] = (),
    ) -> Stiffness:
        """The stiffness at `now_s`.

        roles: of `PerceivedObjects`, whose order must not change between updates. enlarged_volumes_m3 (m,):
        V_i of the enlarged spheres. trigger_directions: for `l2` and `r2` the û_ik (m, 3) in the world frame,
        unit, or zero for a sphere that the trigger does not move. reference_m3 (2,): V_ref of l2 and r2, above 0;
        None for `reference_fraction` of the enlarged volumes' sum. unenlarged_radii_m (m,): for the target's
        detent, None for none. excluded_objects: indices that count nowhere, such as the held object's.
        The first update is not rate limited. ValueError for a wrong shape, a direction that is neither unit nor
        zero, a volume that is negative or not finite, or a time before the last one.
        """
        directions = _checked_directions(trigger_directions, len(enlarged_volumes_m3))
        if not (np.isfinite(enlarged_volumes_m3) & (enlarged_volumes_m3 >= 0.0)).all():
            raise ValueError("enlarged_volumes_m3 holds a negative or non-finite value; valid: 0 or more")
        if self._last is not None and now_s < self._last[0]:
            raise ValueError(f"now_s = {now_s} lies before the last update at {self._last[0]}")
        counted = overlaps.volume_m3 > 0.0
        if excluded_objects:
            counted &= ~np.isin(overlaps.object_index, list(excluded_objects))
        merged = by_object(select(overlaps, np.flatnonzero(counted)))
        if reference_m3 is None:
            reference_m3 = np.full(2, self.settings.reference_fraction * float(enlarged_volumes_m3.sum()))
        if len(merged) > 0 and not (np.isfinite(reference_m3) & (reference_m3 > 0.0)).all():
            raise ValueError(f"the reference volume is {reference_m3} although spheres overlap; valid: above 0")

        objects, shares, detent, capped, blended = _NOTHING
        if len(merged) > 0:
            moved = directions[:, merged.sphere_index]
            objects, shares, detent, capped, blended = self._felt(
                merged, roles, moved, reference_m3, unenlarged_radii_m
            )
        else:
            self._detent_engaged, self._supports = False, {}
        demand = shares.sum(axis=0)
        demand[:2] += detent
        if not self.settings.rumble:
            demand[2] = 0.0
        output, rate_limited = self._rate_limited(np.clip(demand, 0.0, 1.0), now_s)
        return Stiffness(
            l2=float(output[0]),
            r2=float(output[1]),
            rumble=float(output[2]),
            object_index=objects,
            contributions=shares,
            detent_engaged=self._detent_engaged,
            target_capped=capped,
            rate_limited=rate_limited,
            pairs_counted=len(merged),
            pairs_blended=blended,
            pairs_inside=int(merged.centre_inside.sum()),
        )

    def _felt(
        self,
        overlaps: Overlaps,
        roles: Sequence[Role],
        directions: FloatArray,
        reference_m3: FloatArray,
        unenlarged_radii_m: FloatArray | None,
    ) -> _Felt:
        """What the overlaps (p,) give; directions (2, p, 3) of each one's sphere."""
        gradient_trust = trust(overlaps, self.settings.gradient_threshold)
        if self.settings.mode == "total":
            aligned = np.ones((2, len(overlaps)))
        else:
            aligned = alignments(overlaps, directions, gradient_trust, self.settings.inside_margin)
        channels = np.vstack([aligned, 1.0 - aligned.max(axis=0)]) * overlaps.volume_m3
        objects = np.unique(overlaps.object_index)
        belongs = objects[:, None] == overlaps.object_index
        references = np.array([*reference_m3, reference_m3.max()])
        shares: FloatArray = belongs.astype(np.float64) @ channels.T / references

        present = [roles[index] for index in objects.tolist()]
        is_target = np.array([role is Role.TARGET for role in present], dtype=np.bool_)
        of_target = np.flatnonzero(belongs[is_target].any(axis=0))
        detent = self._detent(overlaps, of_target, aligned, unenlarged_radii_m)
        # The detent's step is kept free below the cap, so that it is felt however much overlaps already.
        reserved = 0.0 if unenlarged_radii_m is None else self.settings.detent_step
        capped = _cap(shares, is_target, self.settings.target_cap - reserved)
        self._apply_baseline(objects, present, shares)
        shares[[role is Role.IGNORED for role in present]] = 0.0
        return objects, shares, detent, capped, int((gradient_trust < 1.0).sum())

    def _apply_baseline(self, objects: IntArray, roles: Sequence[Role], shares: FloatArray) -> None:
        """Take from each support's share (a, 3) its value at arming, in place."""
        self._supports = {}
        for row, role in enumerate(roles):
            if role is Role.SUPPORT:
                index = int(objects[row])
                self._supports[index] = shares[row].copy()
                shares[row] = np.maximum(0.0, shares[row] - self._baseline.get(index, 0.0))

    def _detent(
        self, overlaps: Overlaps, rows: IntArray, aligned: FloatArray, radii_m: FloatArray | None
    ) -> FloatArray:
        """What the detent adds to l2 and r2: its step, as far as the trigger leads to where the target touches.

        rows: the overlaps with the target.
        """
        if radii_m is None or len(rows) == 0:
            self._detent_engaged = False
            return np.zeros(2)
        gaps_m = overlaps.signed_distance_m[rows] - radii_m[overlaps.sphere_index[rows]]
        limit_m = self.settings.detent_release_m if self._detent_engaged else self.settings.detent_engage_m
        touching = rows[gaps_m <= limit_m]
        self._detent_engaged = len(touching) > 0
        if not self._detent_engaged:
            return np.zeros(2)
        step: FloatArray = self.settings.detent_step * aligned[:, touching].max(axis=1)
        return step

    def _rate_limited(self, demand: FloatArray, now_s: float) -> tuple[FloatArray, bool]:
        """The demand (3,), reached no faster than the settings allow, and whether that held it back."""
        output = demand
        if self._last is not None:
            last_s, last = self._last
            elapsed_s = now_s - last_s
            output = np.clip(
                demand, last - self.settings.fall_per_s * elapsed_s, last + self.settings.rise_per_s * elapsed_s
            )
        self._last = now_s, output
        return output, bool((output != demand).any())


def _cap(shares: FloatArray, capped: BoolArray, limit: float) -> bool:
    """Shrink the shares (a, 3) of the `capped` objects so that no channel's sum exceeds `limit`; whether any did."""
    totals = shares[capped].sum(axis=0)
    if not (totals > limit).any():
        return False
    shares[capped] *= np.minimum(1.0, limit / np.maximum(totals, _SMALLEST))
    return True


def _checked_directions(trigger_directions: Mapping[str, FloatArray], count: int) -> FloatArray:
    """The directions of l2 and r2 in one array (2, m, 3)."""
    for name in _TRIGGERS:
        shape = np.shape(trigger_directions[name])
        if shape != (count, 3):
            raise ValueError(f"trigger_directions[{name!r}] has the shape {shape}; valid: ({count}, 3)")
    directions = np.stack([trigger_directions[name] for name in _TRIGGERS])
    squared = np.einsum("kmi,kmi->km", directions, directions)
    if not ((np.abs(squared - 1.0) <= 2.0 * _UNIT_TOLERANCE) | (squared == 0.0)).all():
        raise ValueError("trigger_directions holds a vector that is neither unit nor zero; valid: these")
    return directions
