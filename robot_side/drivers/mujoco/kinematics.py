"""Forward kinematics of the simulated robot's gripper from encoder readings (eq. 4)."""

import math
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.arm.forward_kinematics import JOINT, LINK, POINT, LinkTree, Records, place
from robot_side.arm.port import CLUSTER, ArmState, GripperPose
from robot_side.drivers.mujoco.hand.gripper_cover import cover_gripper
from robot_side.drivers.mujoco.model_enums import GeomKind, JointKind
from robot_side.drivers.mujoco.robot_model import RobotModel, can_touch
from robot_side.drivers.mujoco.scene import Scene
from robot_side.gripper.kept_covers import SearchNotes
from robot_side.gripper.near_order import near_order

_ROUND: Final = (GeomKind.SPHERE, GeomKind.CAPSULE, GeomKind.CYLINDER)
_MOST_FOR_A_GEOM: Final = 32


class MujocoKinematics:
    """Kinematics of the scene's robot (port GripperKinematics), from its encoders, never the simulation's truth."""

    def __init__(self, scene: Scene, stand_out_m: float = 0.003, searching: SearchNotes | None = None) -> None:
        """Cover the gripper's geoms with spheres that protrude by at most `stand_out_m`.

        searching: told of each search for spheres, but not of a stored cover. ConfigurationError if the robot has no
        colliding geoms at the tool.
        """
        model, robot = scene.model, scene.robot
        geoms = robot.gripper_geoms
        if geoms.size == 0:
            raise ConfigurationError(
                "model: no geom of the gripper can touch anything; valid: 1 or more colliding geoms"
            )
        data = mujoco.MjData(model)
        data.qpos[:] = scene.data.qpos
        mujoco.mj_kinematics(model, data)
        # Covered in the frames of the links, in which the geoms do not move.
        self.cover = cover_gripper(model, geoms, stand_out_m, searching)
        # Neighbouring spheres are consecutive: the search handles clusters of them.
        on_link = np.einsum("mij,mj->mi", data.xmat[self.cover.bodies].reshape(-1, 3, 3), self.cover.centers_m)
        order = near_order(data.xpos[self.cover.bodies] + on_link, CLUSTER)
        bodies = self.cover.bodies[order]
        self._radii_m = self.cover.radii_m[order]
        self._on_finger = np.isin(bodies, model.geom_bodyid[geoms[robot.geom_on_finger]])
        self.has_fingers = bool(self._on_finger.any())
        # All poses share these two arrays.
        self._radii_m.setflags(write=False)
        self._on_finger.setflags(write=False)
        own = np.flatnonzero(model.body_rootid == robot.root_body)
        self._link_of = np.zeros(model.nbody, dtype=np.int64)
        self._link_of[own] = 1 + np.arange(own.size)
        self._tree = _link_tree(
            model, data, robot, self._link_of, _points(self._link_of[bodies], self.cover.centers_m[order])
        )
        self._link_poses: FloatArray = np.zeros((1 + own.size, 7))
        bodies, centers_m, self._link_radii_m = _cover_links(model, robot)
        self._links_tree = self._tree._replace(points=_points(self._link_of[bodies], centers_m))

    def body_poses(self, bodies: IntArray) -> FloatArray:
        """Return positions and quaternions (n, 7), w first, of the robot's `bodies` (n,) at the last call of `pose`."""
        poses: FloatArray = self._link_poses[self._link_of[bodies]]
        return poses

    def link_spheres(self, state: ArmState) -> tuple[FloatArray, FloatArray]:
        """Return centres (k, 3) and radii (k,) of coarse spheres around the links, by the readings of `state`."""
        positions = state.joint_positions_rad, state.finger_positions
        return place(self._links_tree, *positions, self._link_poses).points_m, self._link_radii_m

    def pose(self, state: ArmState) -> GripperPose:
        """Return the gripper's pose at the encoder readings of `state` (eq. 4).

        The finger joints are in no Jacobian.
        """
        placed = place(self._tree, state.joint_positions_rad, state.finger_positions, self._link_poses)
        return GripperPose(*placed, self._radii_m, self._on_finger)


def _link_tree(model: Any, data: Any, robot: RobotModel, link_of: IntArray, points: Records) -> LinkTree:
    """Return the tree of the robot's links. Links that no reading moves keep the poses that they have in `data`."""
    arm, fingers = robot.arm_positions.tolist(), robot.finger_positions.tolist()
    links = np.zeros(int(link_of.max()) + 1, dtype=LINK)
    joints: list[tuple[Any, ...]] = []
    links["quaternion"][0, 0] = 1.0
    for body in np.flatnonzero(link_of).tolist():
        link, parent = links[link_of[body]], int(model.body_parentid[body])
        link["parent"], link["first_joint"] = link_of[parent], len(joints)
        first = int(model.body_jntadr[body])
        for joint in range(first, first + int(model.body_jntnum[body])):
            address = int(model.jnt_qposadr[joint])
            if address in arm or address in fingers:
                joints.append(
                    (
                        arm.index(address) if address in arm else fingers.index(address),
                        address in arm,
                        model.jnt_type[joint] == JointKind.SLIDE,
                        model.qpos0[address],
                        model.jnt_pos[joint],
                        model.jnt_axis[joint],
                    )
                )
        link["end_joint"] = len(joints)
        moved = link["end_joint"] - link["first_joint"] == model.body_jntnum[body]
        if moved and model.body_mocapid[body] < 0:
            link["position"], link["quaternion"] = model.body_pos[body], model.body_quat[body]
        else:
            link["position"] = data.xmat[parent].reshape(3, 3).T @ (data.xpos[body] - data.xpos[parent])
            turns = [Rotation.from_quat(data.xquat[one], scalar_first=True) for one in (parent, body)]
            link["quaternion"] = (turns[0].inv() * turns[1]).as_quat(scalar_first=True)
    site = robot.site
    return LinkTree(
        links,
        np.array(joints, dtype=JOINT),
        _points(link_of[model.site_bodyid[[site]]], model.site_pos[[site]]),
        model.site_quat[site].copy(),
        points,
    )


def _points(links: IntArray, positions_m: FloatArray) -> Records:
    points = np.empty(len(links), dtype=POINT)
    points["link"], points["position"] = links, positions_m
    return points


def _cover_links(model: Any, robot: RobotModel) -> tuple[IntArray, FloatArray, FloatArray]:
    """Cover the colliding geoms of all links that a joint of the arm moves, but the gripper's, by coarse spheres.

    Return their bodies (k,), centres (k, 3) in the bodies' frames, and radii (k,). They stand in a row along the
    longest side of each geom's box, half of its thickness apart.
    """
    moved = np.isin(model.body_weldid[model.geom_bodyid], model.jnt_bodyid[robot.arm_joints])
    geoms, centers_m, radii_m = [], [np.zeros((0, 3))], []
    for geom in np.setdiff1d(np.flatnonzero(moved), robot.gripper_geoms).tolist():
        if not can_touch(model, geom):
            continue
        half_m = model.geom_aabb[geom, 3:]
        longest = int(np.argmax(half_m))
        others_m = np.delete(half_m, longest)
        thick_m = float(others_m.max() if model.geom_type[geom] in _ROUND else np.hypot(*others_m))
        count = min(math.ceil(2.0 * half_m[longest] / max(thick_m, 1e-4)), _MOST_FOR_A_GEOM)
        part_m = half_m[longest] / count
        along_m = part_m * np.arange(1 - count, count, 2)[:, None] * np.eye(3)[longest]
        own = Rotation.from_quat(model.geom_quat[geom], scalar_first=True)
        centers_m.append(model.geom_pos[geom] + own.apply(model.geom_aabb[geom, :3] + along_m))
        radii_m += [math.hypot(thick_m, part_m)] * count
        geoms += [geom] * count
    bodies = model.geom_bodyid[np.array(geoms, dtype=np.int64)].astype(np.int64)
    return bodies, np.concatenate(centers_m), np.array(radii_m)
