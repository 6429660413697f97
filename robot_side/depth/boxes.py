"""Surfaces as boxes: what the map hands on."""

from dataclasses import dataclass

from common.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes behind the measured surfaces, in the world frame. A box's front is its face at +z of its own frame."""

    ids: IntArray
    """(n,) stable numbers, rising: a box that is seen again keeps its own"""
    centers_m: FloatArray
    """(n, 3) centres"""
    rotations: FloatArray
    """(n, 3, 3) rotations, box to world"""
    half_sizes_m: FloatArray
    """(n, 3) half sizes"""
    roles: IntArray
    """(n,) indices in ROLES; -1 without a role"""
    sds_m: FloatArray
    """(n,) standard deviation of one pixel that made the surface, where it was seen from nearest"""
