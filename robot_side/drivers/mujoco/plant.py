"""Control before a step of the physics, and measurement after it: one kernel each."""

from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import BUNDLE, INDICES, NUMBERS, Declared, records, rows
from robot_side.compiled.kernel import BOOL, FLOAT64, compiled, output_array
from robot_side.drivers.mujoco.drives.joint_drives import (
    DRIVE,
    INPUT,
    control,
    friction_torque,
    motor_acceleration,
    servo_velocity,
)
from robot_side.drivers.mujoco.encoders import reading
from robot_side.drivers.mujoco.hand.gripper_drive import GRIPPER, GRIPPER_INPUT, advance_gripper
from robot_side.drivers.mujoco.joint_reference import REFERENCE, advance_references

INERTIA: Final = np.dtype([("place", np.int64), ("row", np.int64), ("column", np.int64)])
"""Record of an element of the arm's inertia matrix, on or below the diagonal: its index in MuJoCo's sparse array, and
its row and column as numbers of joints"""


class Plant(NamedTuple):
    """Data that both kernels read and write; MuJoCo's arrays keep their addresses."""

    joints: np.ndarray
    """(n,) records of REFERENCE"""
    drives: np.ndarray
    """(n,) records of DRIVE"""
    joint_inputs: np.ndarray
    """(k,) records of INPUT, one or more for each joint"""
    inertia: np.ndarray
    """(k,) records of INERTIA: the elements of `mass` that belong to the arm"""
    grippers: np.ndarray
    """(g,) records of GRIPPER: one or none"""
    samples: FloatArray
    """(s, 4) samples of the gripper's travel (see `GripperDrive`)"""
    inputs: np.ndarray
    """(i,) records of GRIPPER_INPUT"""
    positions: IntArray
    """(n,) indices of the joints in qpos"""
    fingers: IntArray
    """(f,) indices of the fingers' joints in qpos"""
    velocities: IntArray
    """(n,) indices of the joints in qvel"""
    qpos: FloatArray
    qvel: FloatArray
    mass: FloatArray
    """MuJoCo's inertia matrix, sparse"""
    bias: FloatArray
    """(nv,) forces that depend on gravity and velocity (qfrc_bias)"""
    compensated: FloatArray
    """(nv,) forces of gravity compensation"""
    sprung: FloatArray
    """(nv,) forces of springs"""
    lengths: FloatArray
    """(nu,) lengths of the actuators, and `length_speeds` (nu,)"""
    length_speeds: FloatArray
    ctrl: FloatArray
    """(nu,) inputs of the actuators"""


def inertia_table(model: Any, velocities: IntArray) -> np.ndarray:
    """Return records (k,) of INERTIA for the joints whose degrees of freedom are `velocities` (n,)."""
    joint_of = {int(velocity): joint for joint, velocity in enumerate(velocities)}
    found = [
        (place, joint, joint_of[int(model.M_colind[place])])
        for velocity, joint in joint_of.items()
        for place in range(model.M_rowadr[velocity], model.M_rowadr[velocity] + model.M_rownnz[velocity])
        if int(model.M_colind[place]) in joint_of
    ]
    return np.array(found, INERTIA)


PLANT: Final = Declared(
    Plant,
    *(records(REFERENCE), records(DRIVE), records(INPUT), records(INERTIA), records(GRIPPER), rows(4)),
    records(GRIPPER_INPUT),
    *(INDICES,) * 3,
    *(NUMBERS,) * 9,
)
_plant_at = PLANT.at


@compiled(BUNDLE, BOOL, BOOL, FLOAT64, FLOAT64)
def drive(bundle: IntArray, following: bool, ended: bool, closing: float, step_s: float) -> None:
    """Advance the references by `step_s`, and compute the actuators' inputs from these.

    following, ended: from `JointReference.follows`. closing: from `GripperDrive.commanded_at`.
    """
    plant = _plant_at(bundle)
    joints, drives, inertia = plant.joints, plant.drives, plant.inertia
    for j in range(joints.size):
        joints[j].measured_position = plant.qpos[plant.positions[j]]
        joints[j].measured_velocity = plant.qvel[plant.velocities[j]]
    advance_references(joints, following, ended, step_s)
    for j in range(joints.size):
        joint, drive, place = joints[j], drives[j], plant.velocities[j]
        position_error = joint.position - joint.measured_position
        velocity_error = joint.velocity - joint.measured_velocity
        drive.acceleration = joint.acceleration + motor_acceleration(drive, position_error, velocity_error)
        forces = plant.bias[place] - plant.compensated[place] - plant.sprung[place]
        drive.load = forces + friction_torque(drive, joint.velocity, position_error)
    for k in range(inertia.size):
        row, column = inertia[k].row, inertia[k].column
        element = plant.mass[inertia[k].place]
        drives[row].load += element * drives[column].acceleration
        if row != column:
            drives[column].load += element * drives[row].acceleration
    for k in range(plant.joint_inputs.size):
        one = plant.joint_inputs[k]
        joint, drive = joints[one.joint], drives[one.joint]
        velocity = servo_velocity(drive, joint.position - joint.measured_position, joint.velocity)
        plant.ctrl[one.place], drive.load = control(one, joint.position, velocity, drive.load)
    for g in range(plant.grippers.size):
        gripper, closure, closure_speed = plant.grippers[g], 0.0, 0.0
        for i in range(plant.inputs.size):
            finger = plant.inputs[i]
            closure += finger.per_length * (plant.lengths[finger.actuator] - finger.open_length)
            closure_speed += finger.per_length * plant.length_speeds[finger.actuator]
        advance_gripper(gripper, plant.samples, closing, step_s, closure, closure_speed)
        for i in range(plant.inputs.size):
            finger = plant.inputs[i]
            plant.ctrl[finger.place] = finger.open + gripper.reference * (finger.closed - finger.open)


@compiled(BUNDLE, FLOAT64, FLOAT64, output_array(1), output_array(1), output_array(1))
def sense(
    bundle: IntArray,
    sigma: float,
    resolution: float,
    positions: FloatArray,
    velocities: FloatArray,
    fingers: FloatArray,
) -> None:
    """Replace standard normal noise in `positions` (n,) and `fingers` (f,) by readings; fill `velocities` (n,)."""
    plant = _plant_at(bundle)
    for j in range(positions.size):
        positions[j] = reading(positions[j], plant.qpos[plant.positions[j]], sigma, resolution)
        velocities[j] = plant.qvel[plant.velocities[j]]
    for f in range(fingers.size):
        fingers[f] = reading(fingers[f], plant.qpos[plant.fingers[f]], sigma, resolution)
