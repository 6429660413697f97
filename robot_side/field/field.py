"""Field along one direction: the onset distances of the eight strengths."""

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.arm.port import GripperPose
from robot_side.field.look import look
from robot_side.field.scratch import Error, Scratch
from robot_side.surroundings.scene_table import SceneTable

_STILL: FloatArray = np.empty(0)


@dataclass(frozen=True)
class Along:
    """Direction of a look, and the uncertainty along it (eq. 9-10)."""

    direction: FloatArray
    """û (3,), unit, in the world frame"""
    mean_m: float
    """û·(μ_ee - μ_c)"""
    variance_m2: float
    """σ_c²"""
    quantile: float
    """Φ⁻¹(P)"""
    reach_m: float
    """Distance that is examined"""
    mean_along_m: float = 0.0
    """μ_δ"""
    variance_along_m2: float = 0.0
    """σ_δ²"""
    approach_m: FloatArray | None = None
    """Approach of each object (k,), by which its contact distances shorten; None: all are at rest"""


@dataclass(frozen=True)
class Field:
    """Result of one look."""

    onsets_m: FloatArray
    """(2, 8) onset distances of strengths 1 to 8, rising, infinite beyond the reach. The fast list, then the slow one:
    there an object that is to be touched is felt less, and at its expected place."""
    sigma_m: float
    """Largest D_σ of the gripper's spheres"""
    counts: IntArray
    """Counts of the work, indexed by `Count`"""

    @property
    def fast_m(self) -> FloatArray:
        """(8,)"""
        fast_m: FloatArray = self.onsets_m[0]
        return fast_m

    @property
    def slow_m(self) -> FloatArray:
        """(8,)"""
        slow_m: FloatArray = self.onsets_m[1]
        return slow_m


@dataclass
class Ahead:
    """Single looks from Python, as the law's compiled call has them; keeps the scratch memory."""

    encoder_sigma_rad: FloatArray
    """(n,)"""

    def __post_init__(self) -> None:
        self._encoder_variance = self.encoder_sigma_rad * self.encoder_sigma_rad
        self.scratch = Scratch(0, 0, 0)

    def look(
        self, pose: GripperPose, scene: SceneTable, classes: IntArray, along: Along, widest_m: float = np.inf
    ) -> Field:
        """Return the field at `pose`. classes (k,): the objects' (`object_class`). widest_m: half the fingers' gap.

        ValueError names the field of `pose` or `along` that holds NaN or infinity: it would compare as far away, and
        silently give no warning.
        """
        objects = len(scene.first_rows) - 1
        approach_m = _STILL if along.approach_m is None else along.approach_m
        if len(classes) != objects or len(approach_m) not in (0, objects):
            raise ValueError(
                f"classes holds {len(classes)}, approach_m {len(approach_m)}; valid: each of {objects} objects"
            )
        needed = len(pose.sphere_radii_m), len(scene.kinds), len(scene.first_rows)
        if not self.scratch.fits(*needed):
            self.scratch = Scratch(*needed)
        scratch = self.scratch
        found = look(
            *(np.ascontiguousarray(pose.sphere_centers_m), pose.sphere_radii_m, pose.sphere_on_finger),
            *(pose.tool_position_m, np.ascontiguousarray(pose.tool_jacobian), self._encoder_variance),
            *(along.direction, along.mean_m, along.variance_m2, along.mean_along_m, along.variance_along_m2),
            *(along.quantile, widest_m, along.reach_m),
            *(classes, approach_m, scene.bundle, scratch.bundle),
        )
        if not found:
            _refuse(pose, along)
        return Field(scratch.distances_m.copy(), float(scratch.along_m[Error.LARGEST]), scratch.counts.copy())


def _refuse(pose: GripperPose, along: Along) -> NoReturn:
    """Raise the ValueError that names the field that is not finite."""
    for name in ("tool_position_m", "tool_jacobian", "sphere_centers_m", "sphere_radii_m"):
        require_finite(f"pose.{name}", getattr(pose, name))
    for name in ("direction", "mean_m", "variance_m2", "mean_along_m", "variance_along_m2", "quantile", "reach_m"):
        require_finite(f"along.{name}", getattr(along, name))
    if along.approach_m is not None:
        require_finite("along.early_m", along.approach_m)
    raise ValueError("the encoders' errors or the sums of all these are not finite; valid: metres and radians")
