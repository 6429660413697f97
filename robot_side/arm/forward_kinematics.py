"""Forward kinematics (eq. 4) of a robot's tree of links: from readings to tool, Jacobian and spheres in one pass."""

import math
from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, compiled, inlined, input_array, output_array, record_array
from robot_side.compiled.vectors import Vector, add, cross, load, scale, subtract

Quaternion = tuple[float, float, float, float]
"""w first"""
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
"""One link: its row's parent stands before it; its joints; and how it stands to its parent while these are at their
references. The first row is the world, whose parent is itself."""
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
"""One joint, in the frame of its link: a hinge about its unit axis through its anchor, or a slide along it. reading:
its place among the arm's readings, or the fingers'; only the arm's move the tool, and are columns of its Jacobian."""
POINT: Final = np.dtype([("link", np.int64), ("position", np.float64, (3,))])
"""A point that is fixed to a link, in that link's frame."""


class LinkTree(NamedTuple):
    """A robot, and what of it is to be known."""

    links: Records
    """(l,) of LINK"""
    joints: Records
    """(j,) of JOINT, in the order of their links"""
    tool: Records
    """(1,) of POINT"""
    tool_quaternion: FloatArray
    """(4,) of the tool's frame in its link's, w first"""
    points: Records
    """(m,) of POINT"""


class Placed(NamedTuple):
    """Where readings put it, in the world frame; every array is new."""

    tool_position_m: FloatArray
    """(3,)"""
    tool_rotation: FloatArray
    """(3, 3) tool to world"""
    tool_jacobian: FloatArray
    """(6, n) linear rows first"""
    points_m: FloatArray
    """(m, 3)"""


def place(tree: LinkTree, arm_readings: FloatArray, finger_readings: FloatArray, link_poses: FloatArray) -> Placed:
    """Put the tree where the readings of the arm's joints (n,) and of the fingers' (f,) say (eq. 4).

    link_poses (l, 7): filled with each link's position and quaternion, w first.
    """
    placed = Placed(np.empty(3), np.empty((3, 3)), np.empty((6, arm_readings.size)), np.empty((tree.points.size, 3)))
    _place(*tree, arm_readings, finger_readings, link_poses, *placed)
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
    """V turned by a unit quaternion: v + 2 w (u × v) + 2 u × (u × v) with its vector part u."""
    part = q[1], q[2], q[3]
    once = scale(2.0, cross(part, v))
    return add(add(v, scale(q[0], once)), cross(part, once))


@inlined
def _about(axis: Vector, angle: float) -> Quaternion:
    sine = math.sin(0.5 * angle)
    return math.cos(0.5 * angle), sine * axis[0], sine * axis[1], sine * axis[2]


@inlined
def _normalised(q: Quaternion) -> Quaternion:
    length = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return q[0] / length, q[1] / length, q[2] / length, q[3] / length


@inlined
def _vector(values: FloatArray) -> Vector:
    return values[0], values[1], values[2]


@inlined
def _quaternion(values: FloatArray, first: int) -> Quaternion:
    return values[first], values[first + 1], values[first + 2], values[first + 3]


@building_block
def _place_links(
    links: Records, joints: Records, arm: FloatArray, fingers: FloatArray, poses: FloatArray, axes: FloatArray
) -> None:
    """Fill the poses (l, 7) of the links, and of each joint (j, 6) the axis and the anchor, in the world."""
    for row in range(links.size):
        link = links[row]
        position, turn = _vector(link.position), _quaternion(link.quaternion, 0)
        if row > 0:
            of_parent = poses[link.parent]
            parents_turn = _quaternion(of_parent, 3)
            position = add(_vector(of_parent), _turned(parents_turn, position))
            turn = _product(parents_turn, turn)
        for number in range(link.first_joint, link.end_joint):
            joint = joints[number]
            anchor, axis = _vector(joint.anchor), _turned(turn, _vector(joint.axis))
            held = add(position, _turned(turn, anchor))
            way = (arm[joint.reading] if joint.of_arm else fingers[joint.reading]) - joint.reference
            if joint.slides:
                position = add(position, scale(way, axis))
            else:
                turn = _product(turn, _about(_vector(joint.axis), way))
                # The anchor stays where it was.
                position = subtract(held, _turned(turn, anchor))
            for i in range(3):
                axes[number, i], axes[number, 3 + i] = axis[i], held[i]
        turn = _normalised(turn)
        for i in range(3):
            poses[row, i] = position[i]
        for i in range(4):
            poses[row, 3 + i] = turn[i]


@compiled(
    *(record_array(LINK), record_array(JOINT), record_array(POINT), input_array(1), record_array(POINT)),
    *(input_array(1), input_array(1), output_array(2)),
    *(output_array(1), output_array(2), output_array(2), output_array(2)),
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
) -> None:
    axes = np.empty((joints.size, 6))
    _place_links(links, joints, arm, fingers, poses, axes)

    carrier = poses[tool[0].link]
    turn = _quaternion(carrier, 3)
    position = add(_vector(carrier), _turned(turn, _vector(tool[0].position)))
    turn = _normalised(_product(turn, _quaternion(tool_quaternion, 0)))
    columns = _turned(turn, (1.0, 0.0, 0.0)), _turned(turn, (0.0, 1.0, 0.0)), _turned(turn, (0.0, 0.0, 1.0))
    for i in range(3):
        tool_position[i] = position[i]
        tool_rotation[i, 0], tool_rotation[i, 1], tool_rotation[i, 2] = columns[0][i], columns[1][i], columns[2][i]

    for number in range(joints.size):
        joint = joints[number]
        if not joint.of_arm:
            continue
        axis, turned = load(axes, number), (0.0, 0.0, 0.0)
        linear = axis
        if not joint.slides:
            lever = subtract(position, (axes[number, 3], axes[number, 4], axes[number, 5]))
            linear, turned = cross(axis, lever), axis
        for i in range(3):
            jacobian[i, joint.reading], jacobian[3 + i, joint.reading] = linear[i], turned[i]

    for number in range(points.size):
        point = points[number]
        carrier = poses[point.link]
        center = add(_vector(carrier), _turned(_quaternion(carrier, 3), _vector(point.position)))
        for i in range(3):
            centers[number, i] = center[i]
