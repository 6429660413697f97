"""Forward kinematics (eq. 4) of a tree of links: tool, Jacobian and sphere centres from joint readings in one pass."""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import BOOL, building_block, compiled, inlined, input_array, output_array, record_array
from robot_side.compiled.vectors import Vector, add, cross, scale, subtract

Quaternion = tuple[float, float, float, float]
"""Quaternion, w first"""
Rotation = tuple[Vector, Vector, Vector]
"""Rows of a rotation matrix"""
Records = np.ndarray[Any, Any]

LINK: Final = np.dtype(
    [
        ("parent", np.int64),
        ("first_joint", np.int64),
        ("end_joint", np.int64),
        ("position", np.float64, (3,)),
        ("quaternion", np.float64, (4,)),
    ]
)
"""Link of the tree: index of the parent's row, which comes earlier; range of the link's joints; and the link's pose in
the parent's frame with these joints at their references. The first row is the world, which is its own parent."""
JOINT: Final = np.dtype(
    [
        ("reading", np.int64),
        ("of_arm", np.int64),
        ("slides", np.int64),
        ("reference", np.float64),
        ("anchor", np.float64, (3,)),
        ("axis", np.float64, (3,)),
    ]
)
"""Joint in its link's frame: a hinge about the unit axis through the anchor, or a slide along the axis. reading: index
among the arm's or the fingers' readings. Only the arm's joints move the tool, and only these have columns in the
Jacobian."""
POINT: Final = np.dtype([("link", np.int64), ("position", np.float64, (3,))])
"""Point that is fixed to a link, in the link's frame."""

_UNIT: Final = 1e-15
"""A quaternion whose length deviates from 1 by at most this, by rounding, is not normalised."""


class LinkTree(NamedTuple):
    """Links and joints of a robot, its tool, and the points whose positions are wanted."""

    links: Records
    """(l,) records of LINK"""
    joints: Records
    """(j,) records of JOINT, in the order of their links"""
    tool: Records
    """(1,) record of POINT: origin of the tool's frame"""
    tool_quaternion: FloatArray
    """(4,) orientation of the tool's frame in the frame of its link, w first"""
    points: Records
    """(m,) records of POINT"""


class Placed(NamedTuple):
    """Tool and points in the world frame; every array is new."""

    tool_position_m: FloatArray
    """(3,) origin of the tool's frame"""
    tool_rotation: FloatArray
    """(3, 3) tool to world"""
    tool_jacobian: FloatArray
    """(6, n) Jacobian of the tool, linear rows first"""
    points_m: FloatArray
    """(m, 3) positions of the points"""


def place(tree: LinkTree, arm_readings: FloatArray, finger_readings: FloatArray, link_poses: FloatArray) -> Placed:
    """Return the tree's tool and points by readings of the arm's joints (n,) and of the fingers' joints (f,) (eq. 4).

    link_poses (l, 7): filled with each link's position and quaternion, w first. ValueError unless there is one reading
    for each joint.
    """
    placed = Placed(np.empty(3), np.empty((3, 3)), np.empty((6, arm_readings.size)), np.empty((tree.points.size, 3)))
    if not _place(*tree, arm_readings, finger_readings, link_poses, *placed):
        raise ValueError(
            f"{arm_readings.size} readings of the arm and {finger_readings.size} of the fingers; valid: one for each of"
            f" {np.count_nonzero(tree.joints['of_arm'])} and {np.count_nonzero(1 - tree.joints['of_arm'])} joints"
        )
    return placed


@inlined
def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@inlined
def _turned(q: Quaternion, v: Vector) -> Vector:
    """Return `v` rotated by a unit quaternion with scalar part w and vector part u: v + 2 u × (w v + u × v)."""
    x = q[0] * v[0] + q[2] * v[2] - q[3] * v[1]
    y = q[0] * v[1] + q[3] * v[0] - q[1] * v[2]
    z = q[0] * v[2] + q[1] * v[1] - q[2] * v[0]
    return (
        v[0] + 2.0 * (q[2] * z - q[3] * y),
        v[1] + 2.0 * (q[3] * x - q[1] * z),
        v[2] + 2.0 * (q[1] * y - q[2] * x),
    )


@inlined
def _rotation(q: Quaternion) -> Rotation:
    """Return the rotation matrix of a unit quaternion."""
    ww, xx, yy, zz = q[0] * q[0], q[1] * q[1], q[2] * q[2], q[3] * q[3]
    wx, wy, wz, xy, xz, yz = q[0] * q[1], q[0] * q[2], q[0] * q[3], q[1] * q[2], q[1] * q[3], q[2] * q[3]
    return (
        (ww + xx - yy - zz, 2.0 * (xy - wz), 2.0 * (xz + wy)),
        (2.0 * (xy + wz), ww - xx + yy - zz, 2.0 * (yz - wx)),
        (2.0 * (xz - wy), 2.0 * (yz + wx), ww - xx - yy + zz),
    )


@inlined
def _on_link(pose: FloatArray, rotation: Rotation, v: Vector) -> Vector:
    """Return in the world frame the point `v` of a link that has this pose and rotation."""
    return (
        rotation[0][0] * v[0] + rotation[0][1] * v[1] + rotation[0][2] * v[2] + pose[0],
        rotation[1][0] * v[0] + rotation[1][1] * v[1] + rotation[1][2] * v[2] + pose[1],
        rotation[2][0] * v[0] + rotation[2][1] * v[1] + rotation[2][2] * v[2] + pose[2],
    )


@inlined
def _about(axis: Vector, angle: float) -> Quaternion:
    sine = math.sin(0.5 * angle)
    return math.cos(0.5 * angle), sine * axis[0], sine * axis[1], sine * axis[2]


@inlined
def _normalised(q: Quaternion) -> Quaternion:
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if abs(length - 1.0) <= _UNIT:
        return q
    share = 1.0 / length
    return share * q[0], share * q[1], share * q[2], share * q[3]


@inlined
def _vector(values: FloatArray) -> Vector:
    return values[0], values[1], values[2]


@inlined
def _quaternion(values: FloatArray, first: int) -> Quaternion:
    return values[first], values[first + 1], values[first + 2], values[first + 3]


@building_block
def _place_links(
    links: Records,
    joints: Records,
    arm: FloatArray,
    fingers: FloatArray,
    poses: FloatArray,
    axes: FloatArray,
) -> None:
    """Fill the links' poses (l, 7), and each arm joint's axis and anchor as a column (6, n), all in the world frame.

    Operations have MuJoCo's order, so that nearly all digits equal MuJoCo's.
    """
    for row in range(links.size):
        link = links[row]
        position, turn = _vector(link.position), _quaternion(link.quaternion, 0)
        if row > 0:
            parent = _quaternion(poses[link.parent], 3)
            position = _on_link(poses[link.parent], _rotation(parent), position)
            turn = _product(parent, turn)
        for number in range(link.first_joint, link.end_joint):
            joint = joints[number]
            anchor, axis = _vector(joint.anchor), _turned(turn, _vector(joint.axis))
            held = add(_turned(turn, anchor), position)
            way = (arm[joint.reading] if joint.of_arm else fingers[joint.reading]) - joint.reference
            if joint.slides:
                position = add(position, scale(way, axis))
            else:
                turn = _product(turn, _about(_vector(joint.axis), way))
                # The anchor stays where it was.
                position = subtract(held, _turned(turn, anchor))
            for i in range(3 if joint.of_arm else 0):
                axes[i, joint.reading], axes[3 + i, joint.reading] = axis[i], held[i]
        turn = _normalised(turn)
        for i in range(3):
            poses[row, i] = position[i]
        for i in range(4):
            poses[row, 3 + i] = turn[i]


@compiled(
    *(record_array(LINK), record_array(JOINT), record_array(POINT), input_array(1), record_array(POINT)),
    *(input_array(1), input_array(1), output_array(2)),
    *(output_array(1), output_array(2), output_array(2), output_array(2)),
    returns=BOOL,
)
def _place(
    links: Records,
    joints: Records,
    tool: Records,
    tool_quaternion: FloatArray,
    points: Records,
    arm: FloatArray,
    fingers: FloatArray,
    poses: FloatArray,
    tool_position: FloatArray,
    tool_rotation: FloatArray,
    jacobian: FloatArray,
    centers: FloatArray,
) -> bool:
    of_arm = 0
    for number in range(joints.size):
        of_arm += joints[number].of_arm
    if arm.size != of_arm or fingers.size != joints.size - of_arm or poses.shape[0] != links.size:
        return False
    # The Jacobian's array holds the axes and anchors until the tool's position is known.
    _place_links(links, joints, arm, fingers, poses, jacobian)

    carrier = tool[0].link
    turn = _quaternion(poses[carrier], 3)
    position = _on_link(poses[carrier], _rotation(turn), _vector(tool[0].position))
    rotation = _rotation(_product(turn, _quaternion(tool_quaternion, 0)))
    for i in range(3):
        tool_position[i] = position[i]
        for j in range(3):
            tool_rotation[i, j] = rotation[i][j]

    for number in range(joints.size):
        joint = joints[number]
        if not joint.of_arm:
            continue
        column = joint.reading
        axis, turned = (jacobian[0, column], jacobian[1, column], jacobian[2, column]), (0.0, 0.0, 0.0)
        linear = axis
        if not joint.slides:
            lever = subtract(position, (jacobian[3, column], jacobian[4, column], jacobian[5, column]))
            linear, turned = cross(axis, lever), axis
        for i in range(3):
            jacobian[i, column], jacobian[3 + i, column] = linear[i], turned[i]

    before = -1
    for number in range(points.size):
        point = points[number]
        if point.link != before:
            before, rotation = point.link, _rotation(_quaternion(poses[point.link], 3))
        center = _on_link(poses[point.link], rotation, _vector(point.position))
        for i in range(3):
            centers[number, i] = center[i]
    return True
