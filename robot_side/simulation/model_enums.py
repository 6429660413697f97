"""MuJoCo's own numbers for the kinds of joints, geoms and actuators in a compiled model.

They let a module read a model's arrays without importing the library; a test compares them with it.
"""

from enum import IntEnum


class JointKind(IntEnum):
    """mjtJoint"""

    FREE = 0
    BALL = 1
    SLIDE = 2
    HINGE = 3


class GeomKind(IntEnum):
    """mjtGeom, the shapes that take part in collisions."""

    PLANE = 0
    HFIELD = 1
    SPHERE = 2
    CAPSULE = 3
    ELLIPSOID = 4
    CYLINDER = 5
    BOX = 6
    MESH = 7


class TransmissionKind(IntEnum):
    """mjtTrn, as far as an actuator can turn a joint or pull a tendon."""

    JOINT = 0
    JOINT_IN_PARENT = 1
    TENDON = 3


class WrappedKind(IntEnum):
    """mjtWrap, the joints of a fixed tendon."""

    JOINT = 1


class GainKind(IntEnum):
    """mjtGain"""

    FIXED = 0


class BiasKind(IntEnum):
    """mjtBias"""

    NONE = 0
    AFFINE = 1
