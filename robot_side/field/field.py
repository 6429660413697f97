"""Looks from Python: each returns the field along one direction, the onset distances of the eight strengths."""

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.inflation import DirectionalErrors
from robot_side.field.look import look
from robot_side.field.scratch import Scratch
from robot_side.surroundings.scene_table import SceneTable

_STILL: FloatArray = np.empty(0)
_ALIKE: FloatArray = np.empty((0, 2))


@dataclass(frozen=True)
class Field:
    """Result of one look."""

    onsets_m: FloatArray
    """(2, 8) onset distances of strengths 1 to 8: row 0 is the fast list, row 1 the slow list. Each list ascends. A
    strength that begins beyond the examined distance has the distance infinity. In the slow list, an object that is to
    be touched has strength 4 at most. Its onset distances are those of its expected position, without the spread
    D_σ(P) - D_σ(0.5)."""
    sigmas_m: FloatArray
    """(m,) D_σ of each of the gripper's spheres, towards the object with the largest errors"""
    counts: IntArray
    """Counts of the look's work, indexed by `Count`"""

    @property
    def sigma_m(self) -> float:
        """Largest D_σ of the gripper's spheres"""
        return float(self.sigmas_m.max(initial=0.0))

    @property
    def fast_m(self) -> FloatArray:
        """Fast list of onset distances (8,)"""
        fast_m: FloatArray = self.onsets_m[0]
        return fast_m

    @property
    def slow_m(self) -> FloatArray:
        """Slow list of onset distances (8,)"""
        slow_m: FloatArray = self.onsets_m[1]
        return slow_m


@dataclass
class Ahead:
    """Makes single looks from Python, equal to those in the law's compiled call. It keeps the scratch memory."""

    encoder_sigma_rad: FloatArray
    """Standard deviation σ_θ of each joint's measured angle (n,)"""

    def __post_init__(self) -> None:
        self._encoder_variance = self.encoder_sigma_rad * self.encoder_sigma_rad
        self.scratch = Scratch(0, 0, 0)

    def look(
        self,
        pose: GripperPose,
        scene: SceneTable,
        classes: IntArray,
        along: Along,
        widest_m: float = np.inf,
        *,
        full_only: bool = False,
    ) -> Field:
        """Return the field along `along` from `pose`. classes (k,): class of each object (`object_class`).

        widest_m: half the gap between the fingers, the largest inflation of a finger's sphere towards the target.
        full_only: look for full strength alone, so that the other onset distances are -∞. NaN or infinity would compare
        as far away and silently give no warning. So a ValueError names the field of `pose` or `along` that holds it.
        """
        objects = len(scene.first_rows) - 1
        approach_m = _STILL if along.approach_m is None else along.approach_m
        of_objects = _ALIKE if along.of_objects is None else along.of_objects
        if len(classes) != objects or not {len(approach_m), len(of_objects)} <= {0, objects}:
            raise ValueError(
                f"classes has {len(classes)} entries, approach_m has {len(approach_m)}, of_objects has"
                f" {len(of_objects)}; valid: one for each of {objects} objects"
            )
        needed = len(pose.sphere_radii_m), len(scene.kinds), len(scene.first_rows)
        if not self.scratch.fits(*needed):
            self.scratch = Scratch(*needed)
        scratch = self.scratch
        prediction = along.mean_along_m, along.variance_along_m2
        errors = DirectionalErrors(along.mean_m, along.variance_m2, *prediction, along.quantile, along.unseen_m)
        around = widest_m, along.reach_m, classes, approach_m, of_objects, full_only, scene.bundle, scratch.bundle
        found = look(
            *(np.ascontiguousarray(pose.sphere_centers_m), pose.sphere_radii_m, pose.sphere_on_finger),
            *(pose.tool_position_m, np.ascontiguousarray(pose.tool_jacobian), self._encoder_variance),
            *(along.direction, errors, *around),
        )
        if not found:
            _refuse(pose, along)
        sigmas_m = scratch.sigma_m[: len(pose.sphere_radii_m), 0].copy()
        return Field(scratch.distances_m.copy(), sigmas_m, scratch.counts.copy())


def _refuse(pose: GripperPose, along: Along) -> NoReturn:
    """Raise a ValueError that names the field of `pose` or `along` that is not finite."""
    for name in ("tool_position_m", "tool_jacobian", "sphere_centers_m", "sphere_radii_m"):
        require_finite(f"pose.{name}", getattr(pose, name))
    for name, value in vars(along).items():
        if value is not None:
            require_finite(f"along.{name}", value)
    raise ValueError(
        "encoder_sigma_rad, or a sum of the other values, is not finite; valid: finite values in metres and radians"
    )
