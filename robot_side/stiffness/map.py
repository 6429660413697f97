"""From overlaps to the stiffness of the two triggers and the rumble (§4.2, and what each role counts).

Trigger k moves sphere i along the unit vector û_ik. Its stiffness is the overlap in its way, as a share of a
reference volume: s_k = clip(Σ_ij V_ij a_ijk / V_ref, 0, 1), V_ref = f Σ_i V_i, with the alignment a_ijk from
`alignments`. Roles bend that sum: the target's part is capped, a support counts beyond its value at arming.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from common.arrays import FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.compiled.kernel import NUMBER, TRUTH, compiled, input_array
from robot_side.objects.perceived import Role
from robot_side.pairs.overlaps import Overlaps, by_object, select
from robot_side.stiffness.alignment import alignments, trust
from robot_side.stiffness.object_shares import Shares, object_shares

_TRIGGERS = ("l2", "r2")
_UNIT_TOLERANCE = 1e-6

_Channels = tuple[float, ...]
"""One value each for l2, r2 and rumble."""
_Felt = tuple[dict[int, Shares], _Channels, bool, int]
"""The objects' shares, what the detent adds, whether the target was capped, pairs blended."""
_NOTHING = 0.0, 0.0, 0.0


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
        self._baseline: dict[int, Shares] = {}
        self._supports: dict[int, Shares] | None = None
        self._detent_engaged = False
        self._last: tuple[float, _Channels] | None = None

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
        enlarged_m3: float = _total_volume(np.ascontiguousarray(enlarged_volumes_m3))
        if math.isnan(enlarged_m3):
            raise ValueError("enlarged_volumes_m3 holds a negative or non-finite value; valid: 0 or more")
        if self._last is not None and now_s < self._last[0]:
            raise ValueError(f"now_s = {now_s} lies before the last update at {self._last[0]}")
        merged = _counted(overlaps, excluded_objects)
        if reference_m3 is None:
            reference_m3 = np.full(2, self.settings.reference_fraction * enlarged_m3)
        shares, detent, capped, blended = self._felt(merged, roles, directions, reference_m3, unenlarged_radii_m)
        demand = [sum(channel) for channel in zip(detent, *shares.values(), strict=True)]
        if not self.settings.rumble:
            demand[2] = 0.0
        (l2, r2, rumble), rate_limited = self._rate_limited(demand, now_s)
        return Stiffness(
            l2=l2,
            r2=r2,
            rumble=rumble,
            object_index=np.array(list(shares), dtype=np.int64),
            contributions=np.array(list(shares.values()), dtype=np.float64).reshape(len(shares), 3),
            detent_engaged=self._detent_engaged,
            target_capped=capped,
            rate_limited=rate_limited,
            pairs_counted=len(merged),
            pairs_blended=blended,
            pairs_inside=int(np.count_nonzero(merged.centre_inside)),
        )

    def _felt(
        self,
        overlaps: Overlaps,
        roles: Sequence[Role],
        directions: Sequence[FloatArray],
        reference_m3: FloatArray,
        unenlarged_radii_m: FloatArray | None,
    ) -> _Felt:
        """What the overlaps (p,) give; directions: û (m, 3) of each sphere for l2 and r2."""
        if len(overlaps) == 0:
            self._detent_engaged, self._supports = False, {}
            return {}, _NOTHING, False, 0
        if not all(0.0 < reference < math.inf for reference in reference_m3.tolist()):
            raise ValueError(f"the reference volume is {reference_m3} although spheres overlap; valid: above 0")
        gradient_trust = trust(overlaps, self.settings.gradient_threshold)
        if self.settings.mode == "total":
            aligned = np.ones((2, len(overlaps)))
        else:
            moved = np.array([motion.take(overlaps.sphere_index, axis=0) for motion in directions])
            aligned = alignments(overlaps, moved, gradient_trust, self.settings.inside_margin)
        shares = object_shares(overlaps, aligned, reference_m3)
        detent = self._detent(overlaps, roles, aligned, unenlarged_radii_m)
        # The detent's step is kept free below the cap, so that it is felt however much overlaps already.
        reserved = 0.0 if unenlarged_radii_m is None else self.settings.detent_step
        targets = [share for index, share in shares.items() if roles[index] is Role.TARGET]
        capped = _cap(targets, self.settings.target_cap - reserved)
        self._supports = {index: share for index, share in shares.items() if roles[index] is Role.SUPPORT}
        for index, share in shares.items():
            if roles[index] is Role.SUPPORT:
                baseline = self._baseline.get(index, _NOTHING)
                shares[index] = [max(0.0, value - before) for value, before in zip(share, baseline, strict=True)]
            elif roles[index] is Role.IGNORED:
                shares[index] = [*_NOTHING]
        return shares, detent, capped, int(np.count_nonzero(gradient_trust < 1.0))

    def _detent(
        self, overlaps: Overlaps, roles: Sequence[Role], aligned: FloatArray, radii_m: FloatArray | None
    ) -> _Channels:
        """What the detent adds: its step, as far as the trigger leads to where the target touches."""
        if radii_m is None:
            self._detent_engaged = False
            return _NOTHING
        limit_m = self.settings.detent_release_m if self._detent_engaged else self.settings.detent_engage_m
        pairs = zip(
            overlaps.object_index.tolist(),
            overlaps.sphere_index.tolist(),
            overlaps.signed_distance_m.tolist(),
            strict=True,
        )
        rows = [
            row
            for row, (index, sphere, distance_m) in enumerate(pairs)
            if roles[index] is Role.TARGET and distance_m - radii_m[sphere] <= limit_m
        ]
        self._detent_engaged = len(rows) > 0
        if not rows:
            return _NOTHING
        l2, r2 = aligned[:, rows].max(axis=1).tolist()
        return self.settings.detent_step * l2, self.settings.detent_step * r2, 0.0

    def _rate_limited(self, demand: Sequence[float], now_s: float) -> tuple[_Channels, bool]:
        """The demand, clipped to 0 to 1 and reached no faster than the settings allow, and whether that held it."""
        wanted = tuple(min(max(value, 0.0), 1.0) for value in demand)
        output = wanted
        if self._last is not None:
            last_s, last = self._last
            fall = self.settings.fall_per_s * (now_s - last_s)
            rise = self.settings.rise_per_s * (now_s - last_s)
            output = tuple(min(max(new, old - fall), old + rise) for new, old in zip(wanted, last, strict=True))
        self._last = now_s, output
        return output, output != wanted


def _counted(overlaps: Overlaps, excluded_objects: Collection[int]) -> Overlaps:
    """One row for each sphere and object that overlap, without the excluded objects."""
    if len(overlaps) == 0:
        return overlaps
    counts = overlaps.volume_m3 > 0.0
    for index in excluded_objects:
        counts &= overlaps.object_index != index
    return by_object(select(overlaps, np.flatnonzero(counts)))


def _cap(targets: Sequence[Shares], limit: float) -> bool:
    """Shrink the targets' shares, in place, so that no channel's sum exceeds `limit`; whether any did."""
    capped = False
    for channel in range(3):
        total = sum(share[channel] for share in targets)
        if total > limit:
            capped = True
            for share in targets:
                share[channel] *= limit / total
    return capped


def _checked_directions(trigger_directions: Mapping[str, FloatArray], count: int) -> list[FloatArray]:
    """The directions (m, 3) of l2 and r2."""
    directions = [np.ascontiguousarray(trigger_directions[name]) for name in _TRIGGERS]
    for name, vectors in zip(_TRIGGERS, directions, strict=True):
        if vectors.shape != (count, 3):
            raise ValueError(f"trigger_directions[{name!r}] has the shape {vectors.shape}; valid: ({count}, 3)")
        if not _are_unit_or_zero(vectors):
            raise ValueError("trigger_directions holds a vector that is neither unit nor zero; valid: these")
    return directions


@compiled(input_array(2), returns=TRUTH)
def _are_unit_or_zero(vectors: FloatArray) -> bool:
    for row in range(vectors.shape[0]):
        squared = vectors[row, 0] ** 2 + vectors[row, 1] ** 2 + vectors[row, 2] ** 2
        # False for NaN, too.
        if not (squared == 0.0 or abs(squared - 1.0) <= 2.0 * _UNIT_TOLERANCE):
            return False
    return True


@compiled(input_array(1), returns=NUMBER)
def _total_volume(volumes: FloatArray) -> float:
    """The sum of the volumes (m,); NaN when one of them is negative or not finite."""
    total = 0.0
    for volume in volumes:
        if not 0.0 <= volume < math.inf:
            return math.nan
        total += volume
    return total
