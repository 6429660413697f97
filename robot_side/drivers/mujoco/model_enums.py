"""MuJoCo's numbers for kinds of joints, geoms and actuators, in its order; a test compares them with MuJoCo.

With these numbers a module can read a model's arrays without importing MuJoCo.
"""

from enum import IntEnum

JointKind = IntEnum("JointKind", "FREE BALL SLIDE HINGE", start=0)
GeomKind = IntEnum("GeomKind", "PLANE HFIELD SPHERE CAPSULE ELLIPSOID CYLINDER BOX MESH", start=0)
"""Kinds of geoms that take part in collisions"""
TransmissionKind = IntEnum("TransmissionKind", "JOINT JOINT_IN_PARENT SLIDER_CRANK TENDON", start=0)
WrappedKind = IntEnum("WrappedKind", "NONE JOINT", start=0)
"""Kinds of elements of which a fixed tendon consists"""
GainKind = IntEnum("GainKind", "FIXED AFFINE MUSCLE DCMOTOR SO3 PID", start=0)
DynamicsKind = IntEnum("DynamicsKind", "NONE INTEGRATOR FILTER FILTEREXACT", start=0)
"""Kinds of internal states of actuators"""
BiasKind = IntEnum("BiasKind", "NONE AFFINE", start=0)
