"""From where the gripper is and how it moves to what the operator's fingers are to feel: eq. 5-12 and §4.2.

pose, joint velocities ─▶ enlargement ─▶ candidate pairs ─▶ overlaps ─▶ stiffness
"""

from dataclasses import dataclass, field, replace

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import trigger_directions
from robot_side.enlargement.distance import Enlargement
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.gripper.between_fingers import outside_share
from robot_side.objects.perceived import PerceivedObjects
from robot_side.pairs.candidates import CandidatePairs, candidate_pairs
from robot_side.pairs.overlaps import (
    NearestSurfaces,
    Overlaps,
    evaluate,
    nearest_surfaces,
    radii_for_role,
)
from robot_side.pairs.touching import touching_pairs
from robot_side.stiffness.map import Stiffness, StiffnessMap
from robot_side.stiffness.reference_volume import plane_overlaps


@dataclass(frozen=True)
class Sensed:
    """What one tick found out about the surroundings."""

    enlargement_m: FloatArray
    """(m,) of each gripper sphere"""
    overlap_m3: float
    """Total over all pairs of a sphere and an object, but for the object that the gripper holds"""
    stiffness: Stiffness


@dataclass
class Skipped:
    """How much work the scene did not need, over the run."""

    pairs_culled: int = 0
    """Pairs of a sphere and a primitive that were too far apart to be looked at."""
    ticks_without_candidates: int = 0
    """Ticks in which nothing was near, so that no distance and no overlap was computed."""
    enlargement_limits: int = 0
    """Pairs whose enlargement was limited to half the gap between the fingers (§3.4)."""


@dataclass
class AheadSensing:
    """Keeps what the stiffness has to remember from tick to tick."""

    enlargement: Enlargement
    stiffness_map: StiffnessMap
    encoder_sigma_rad: FloatArray
    """(n,)"""
    skipped: Skipped = field(default_factory=Skipped)

    def sense(
        self,
        pose: GripperPose,
        joint_velocities_rad_s: FloatArray,
        objects: PerceivedObjects,
        loop_age_s: float,
        gap_m: float | None,
        excluded: int | None,
        now_s: float,
    ) -> Sensed:
        """Work out one tick.

        joint_velocities_rad_s (n,); loop_age_s: t_d of eq. 8; gap_m: free gap between the fingers, None without a
        gripper; excluded: the object that the gripper holds, which is no danger to it.
        """
        covariances = position_covariance(pose.sphere_jacobians, self.encoder_sigma_rad)
        velocities = pose.sphere_jacobians @ joint_velocities_rad_s
        enlargement_m = self.enlargement.distances(covariances, velocities, loop_age_s)
        enlarged_m = pose.sphere_radii_m + enlargement_m
        pairs = candidate_pairs(pose.sphere_centers_m, enlarged_m, objects)
        self.skipped.pairs_culled += pairs.pairs_skipped
        if len(pairs) == 0:
            self.skipped.ticks_without_candidates += 1
        nearest = nearest_surfaces(pose.sphere_centers_m, objects, pairs)
        towards_object = self.enlargement.settings.direction == "towards_object"
        if towards_object:
            sphere = pairs.sphere_index
            pair_enlargement_m = self.enlargement.distances_towards(
                covariances[sphere], velocities[sphere], loop_age_s, nearest.direction
            )
        else:
            pair_enlargement_m = enlargement_m.take(pairs.sphere_index)
        radii_m, binding = radii_for_role(pose.sphere_radii_m, pair_enlargement_m, pairs, objects.roles, gap_m)
        self.skipped.enlargement_limits += binding
        overlaps = _overlaps(pose, objects, *touching_pairs(pairs, nearest, radii_m, excluded))
        directions = trigger_directions(pose.tool_rotation, len(enlarged_m))
        reference_m3 = None
        if len(overlaps) > 0 and self.stiffness_map.settings.reference == "plane":
            axes = np.array([directions[trigger][0] for trigger in ("l2", "r2")])
            # The enlargement that a plane square to the trigger's direction would meet.
            towards_plane_m = enlargement_m
            if towards_object:
                towards_plane_m = self.enlargement.distances_towards(
                    covariances, velocities, loop_age_s, np.broadcast_to(axes, (len(enlarged_m), *axes.shape))
                ).T
            reference_m3 = plane_overlaps(pose.sphere_centers_m, pose.sphere_radii_m, towards_plane_m, axes)
        stiffness = self.stiffness_map.update(
            overlaps,
            objects.roles,
            4.0 / 3.0 * np.pi * enlarged_m * enlarged_m * enlarged_m,
            directions,
            now_s,
            reference_m3=reference_m3,
            unenlarged_radii_m=pose.sphere_radii_m,
        )
        return Sensed(enlargement_m, float(overlaps.volume_m3.sum()), stiffness)


def _overlaps(
    pose: GripperPose, objects: PerceivedObjects, pairs: CandidatePairs, nearest: NearestSurfaces, radii_m: FloatArray
) -> Overlaps:
    """The overlaps of `pairs` without what lies between the fingers; radii_m (p,) enlarged."""
    overlaps = evaluate(pose.sphere_centers_m, radii_m, objects, pairs, nearest)
    share = outside_share(pose, objects, pairs, nearest)
    if share is None:
        return overlaps
    return replace(overlaps, volume_m3=share * overlaps.volume_m3, gradient_m2=share[:, None] * overlaps.gradient_m2)
