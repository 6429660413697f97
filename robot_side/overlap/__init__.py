"""Exact overlap volumes of spheres with simple solids, their gradients, and `warm_up` to compile beforehand.

Read `volumes` for the functions, `orthoscheme` for the idea, `kernels` for what a 1 kHz tick calls.
"""

from robot_side.overlap.kernels import warm_up
from robot_side.overlap.volumes import sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron

__all__ = ["sphere_box", "sphere_half_space", "sphere_sphere", "sphere_tetrahedron", "warm_up"]
