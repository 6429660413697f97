"""From a joint reference to what each joint's actuator is told: position servo, velocity servo or motor."""

from dataclasses import dataclass

import numpy as np

from common.arrays import BoolArray, FloatArray

# The stiffness of what this controller closes itself; servos of the model bring their own.
_MOTOR_BANDWIDTH_RAD_S = 50.0
_VELOCITY_SERVO_BANDWIDTH_RAD_S = 20.0
_MOST_WINDUP_RAD = 0.02


@dataclass(frozen=True)
class JointDrives:
    """One actuator on each arm joint, all (n,): torque = gear (gain u + offset - stiffness l - damping dl/dt).

    Here u is its input and l = gear q its length, which is MuJoCo's fixed gain with an affine bias. A position
    servo has stiffness and damping, a velocity servo only damping, a motor neither.
    """

    gear: FloatArray
    gain: FloatArray
    offset: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    strongest: FloatArray
    """The greatest torque, N m, or force, N, that it gives; infinite where the model does not say"""

    def windup_rad(self, least_rad: float) -> FloatArray:
        """How far a reference may lead each joint (n,): until a servo gives an eighth of what it can.

        No less than least_rad, and at most 20 mrad, which every other drive has.
        """
        stiffness = self.gear**2 * self.stiffness
        known = (stiffness > 0.0) & np.isfinite(self.strongest)
        pressing = np.divide(self.strongest, 8.0 * stiffness, out=np.full_like(stiffness, np.inf), where=known)
        return np.clip(pressing, least_rad, max(_MOST_WINDUP_RAD, least_rad))

    @property
    def is_motor(self) -> BoolArray:
        """(n,) whether an actuator gives the torque that it is told, with no servo of its own."""
        motor: BoolArray = (self.stiffness == 0.0) & (self.damping == 0.0)
        return motor

    @property
    def _is_velocity_servo(self) -> BoolArray:
        servo: BoolArray = (self.stiffness == 0.0) & (self.damping != 0.0)
        return servo

    def motor_acceleration(self, position_error: FloatArray, velocity_error: FloatArray) -> FloatArray:
        """The joint acceleration (n,) that a motor's critically damped loop adds to its reference's; 0 for servos.

        The errors (n,) are reference less measured. The caller multiplies by the arm's inertia.
        """
        wanted = _MOTOR_BANDWIDTH_RAD_S**2 * position_error + 2.0 * _MOTOR_BANDWIDTH_RAD_S * velocity_error
        return np.where(self.is_motor, wanted, 0.0)

    def control(
        self,
        measured_position_rad: FloatArray,
        reference_position_rad: FloatArray,
        reference_velocity_rad_s: FloatArray,
        load: FloatArray,
    ) -> FloatArray:
        """The actuators' inputs u (n,) under which the joints follow their references.

        load (n,): the torque, N m, that holds the joints against gravity, friction and their own inertia; force in N
        for a prismatic joint. A servo is told its reference ahead by what its damping holds back, so that it
        does not lag while it moves.
        """
        correction = np.where(
            self._is_velocity_servo,
            _VELOCITY_SERVO_BANDWIDTH_RAD_S * (reference_position_rad - measured_position_rad),
            0.0,
        )
        geared = (
            load / self.gear
            - self.offset
            + self.gear * self.stiffness * reference_position_rad
            + self.gear * self.damping * (reference_velocity_rad_s + correction)
        )
        result: FloatArray = geared / self.gain
        return result
