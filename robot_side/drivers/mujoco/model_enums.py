"""MuJoCo's numbers for the kinds of joints, geoms and actuators, in its order; a test compares them with MuJoCo.

With them a module can read a model's arrays without importing the library.
"""

from enum import IntEnum

JointKind = IntEnum("JointKind", "FREE BALL SLIDE HINGE", start=0)
GeomKind = IntEnum("GeomKind", "PLANE HFIELD SPHERE CAPSULE ELLIPSOID CYLINDER BOX MESH", start=0)
"""Shapes that take part in collisions."""
TransmissionKind = IntEnum("TransmissionKind", "JOINT JOINT_IN_PARENT SLIDER_CRANK TENDON", start=0)
WrappedKind = IntEnum("WrappedKind", "NONE JOINT", start=0)
"""Parts of a fixed tendon."""
GainKind = IntEnum("GainKind", "FIXED", start=0)
BiasKind = IntEnum("BiasKind", "NONE AFFINE", start=0)
