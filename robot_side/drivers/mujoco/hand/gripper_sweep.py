"""Sweep of a simulated gripper: where its fingers rest in empty space, over those inputs that move them."""

import copy
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from robot_side.drivers.mujoco.hand.gripper_gap import HandPoses
from robot_side.drivers.mujoco.mesh_arrays import geom_points
from robot_side.drivers.mujoco.robot_model import Simulated

STROKE_TIME_S: Final = 0.6
"""Time for the whole stroke at full speed, that of a Robotiq 2F-85: 85 mm at 150 mm/s (its manual)"""
SPEED_TIME_CONSTANT_S: Final = 0.05
"""Time constant of the measured speed: stiff fingers chatter on a gripped object"""
_SAMPLES: Final = 9
_SHORTEST_SETTLING_S, _LONGEST_SETTLING_S = 0.05, 2.0
_RESTING: Final = 1e-3
"""Speed of a finger's joint, in rad/s or m/s, below which it rests"""
_RESTED_S: Final = 0.02
_SWING_S: Final = 0.4
_TURNS: Final = 4
"""Number of turns within that time from which on fingers swing"""
_UNMOVED: Final = 0.01
"""Share of an actuator's travel up to which inputs have moved nothing"""
_EVEN: Final = 0.75
"""Least step at an end, as a share of the largest step between samples, at which no inputs are dead there"""
_FINE: Final = 1.0 / 32.0
"""Largest share of the travel by which dead inputs may be left"""
_FINEST: Final = 1e-5
"""Share of all inputs below which what moves the fingers is a single input"""

_AFTER_S: Final = 0.4
"""Time after the last input of a run, in which slow fingers may arrive"""
_PAUSES: Final = (0.25, 0.5, 0.75)
"""Inputs of a run at which it pauses, as a person may"""
_PAUSE_S: Final = 0.2
_SMALLEST: Final = 1e-6
"""Change of an actuator's length, in its own unit, below which its inputs move nothing"""


@dataclass(frozen=True)
class GripperSweep:
    """Rest positions of a gripper at k inputs, evenly spaced for each of its g actuators."""

    controls: FloatArray
    """(k, g) inputs of the actuators"""
    fingers: FloatArray
    """(k, f) positions of the fingers' joints, within their ranges"""
    lengths: FloatArray
    """(k, g) lengths of the actuators there, each in the unit of its transmission"""
    poses: HandPoses
    ahead_m: float
    """Reach of the fingers ahead of the tool's site, open or closed, in m"""

    @property
    def per_length(self) -> FloatArray:
        """(g,) weights with which changes of the lengths add up to a position, 0 at the first sample and 1 at the last.

        An actuator that moves little counts little.
        """
        way: FloatArray = self.lengths[-1] - self.lengths[0]
        return way / max(float(way @ way), _SMALLEST**2)


class ClosingRun(NamedTuple):
    """Run of the gripper in which it closes on nothing, at n steps."""

    references: FloatArray
    """(n,) inputs as shares of the way from open (0) to closed (1)"""
    closures: FloatArray
    """(n,) positions from 0 to 1"""
    speeds: FloatArray
    """(n,) rates of the closures, averaged, in 1/s"""
    step_s: float


class EmptySpace:
    """Copy of a scene's gripper in empty space; its arm is without drive, and put back after every step."""

    def __init__(self, scene: Simulated) -> None:
        """Begin at the scene's present configuration."""
        self.robot, self.actuators = scene.robot, scene.robot.gripper_actuators
        self.model: Any = copy.copy(scene.model)
        model = self.model
        self._gravity = float(np.linalg.norm(model.opt.gravity))
        model.opt.gravity[:] = 0.0
        elsewhere = model.body_rootid[model.geom_bodyid] != self.robot.root_body
        model.geom_contype[elsewhere] = model.geom_conaffinity[elsewhere] = 0
        idle = np.setdiff1d(np.arange(model.nactuator), self.actuators)
        model.actuator_gainprm[idle] = model.actuator_biasprm[idle] = 0.0
        self.data, self._within = mujoco.MjData(model), mujoco.MjData(model)
        self._start = scene.data.qpos.copy()
        self._held = self._start[self.robot.arm_positions]
        joints = [np.flatnonzero(model.jnt_qposadr == place)[0] for place in self.robot.finger_positions]
        limited = model.jnt_limited[joints].astype(bool)
        self._lower = np.where(limited, model.jnt_range[joints, 0], -np.inf)
        self._upper = np.where(limited, model.jnt_range[joints, 1], np.inf)

    def step(self, control: FloatArray) -> None:
        """Advance by one step with the actuators' inputs `control` (g,)."""
        data, robot = self.data, self.robot
        data.ctrl[robot.gripper_controls] = control
        mujoco.mj_step(self.model, data)
        data.qpos[robot.arm_positions] = self._held
        data.qvel[robot.arm_velocities] = 0.0

    @property
    def rests(self) -> bool:
        """Whether the fingers stand."""
        return bool(np.abs(self.data.qvel[self.robot.finger_velocities]).max(initial=0.0) < _RESTING)

    def settle(self, control: FloatArray) -> Any:
        """Let the fingers come to rest at `control` (g,); return their state, an MjData, within the joints' ranges.

        Limits are soft: strong inputs push a joint beyond its range. Fingers that swing on and on are at their mean.
        """
        places, timestep_s, rested_s = self.robot.finger_positions, float(self.model.opt.timestep), 0.0
        recent = np.zeros((round(_SWING_S / timestep_s), places.size))
        for step in range(round(_LONGEST_SETTLING_S / timestep_s)):
            self.step(control)
            at = recent[step % len(recent)] = self.data.qpos[places]
            # Fingers that swing stand for a moment, too.
            rested_s = rested_s + timestep_s if self.rests else 0.0
            if rested_s > _RESTED_S and step * timestep_s > _SHORTEST_SETTLING_S:
                break
            if (step + 1) % len(recent) == 0 and _swings(recent):
                at = recent.mean(axis=0)
                break
        within = self._within
        within.qpos[:] = self.data.qpos
        within.qpos[places] = np.clip(at, self._lower, self._upper)
        mujoco.mj_kinematics(self.model, within)
        mujoco.mj_comPos(self.model, within)
        mujoco.mj_tendon(self.model, within)
        mujoco.mj_transmission(self.model, within)
        return within

    def lengths(self, control: FloatArray) -> FloatArray:
        """Return the actuators' lengths (g,) at rest at `control` (g,)."""
        lengths: FloatArray = self.settle(control).actuator_length[self.actuators].copy()
        return lengths

    def sweep(self, first: FloatArray, last: FloatArray) -> GripperSweep:
        """Return the rest positions at inputs from `first` (g,) to `last` (g,)."""
        robot, bodies = self.robot, (self.model.nbody, 3)
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = self._start
        controls = np.linspace(first, last, _SAMPLES)
        fingers, lengths, rotations, positions_m, ahead_m = [], [], [], [], []
        for control in controls:
            at = self.settle(control)
            frame = at.site_xmat[robot.site].reshape(3, 3)
            fingers.append(at.qpos[robot.finger_positions].copy())
            lengths.append(at.actuator_length[self.actuators].copy())
            rotations.append(frame.T @ at.xmat.reshape(*bodies, 3))
            positions_m.append((at.xpos - at.site_xpos[robot.site]) @ frame)
            points_m = geom_points(self.model, at, robot.gripper_geoms[robot.geom_on_finger])
            ahead_m.append(float(((points_m - at.site_xpos[robot.site]) @ frame[:, 2]).max()) if len(points_m) else 0.0)
        poses = HandPoses(np.array(rotations), np.array(positions_m))
        return GripperSweep(controls, np.array(fingers), np.array(lengths), poses, max(ahead_m[0], ahead_m[-1]))

    def close(self, sweep: GripperSweep, most: float, lag_s: float, force_lead: float) -> ClosingRun:
        """Close on nothing by inputs that rise from open (0) to closed (1), and on to `most`, with pauses.

        sweep: from open to closed. The reference leads the fingers by what their speed, times `lag_s`, and the largest
        force, at `force_lead`, need, as in `advance_gripper`.
        """
        self.settle(sweep.controls[0])
        timestep_s, samples = float(self.model.opt.timestep), []
        way, weights = sweep.controls[-1] - sweep.controls[0], sweep.per_length
        closures = (sweep.lengths - sweep.lengths[0]) @ weights
        rise, pause = timestep_s / STROKE_TIME_S, round(_PAUSE_S / timestep_s)
        told = np.minimum(np.arange(round((most * STROKE_TIME_S + _AFTER_S) / timestep_s)) * rise, most)
        for at in _PAUSES:
            told = np.insert(told, np.searchsorted(told, at), np.full(pause, at))
        reference = closure = speed = 0.0
        for moved in np.diff(told):
            free = float(np.interp(closure, closures, np.linspace(0.0, 1.0, _SAMPLES)))
            reference = min(reference + moved, free + lag_s * speed + force_lead) if moved > 0.0 else reference
            self.step(sweep.controls[0] + reference * way)
            lengths, rates = (
                values[self.actuators] for values in (self.data.actuator_length, self.data.actuator_velocity)
            )
            closure = float((lengths - sweep.lengths[0]) @ weights)
            speed += (float(rates @ weights) - speed) * min(timestep_s / SPEED_TIME_CONSTANT_S, 1.0)
            samples.append((reference, closure, speed))
        references, run, speeds = np.array(samples).T
        return ClosingRun(references, run, speeds, timestep_s)

    def weights(self, closing: FloatArray) -> list[FloatArray]:
        """Return accelerations (3,) in the world whose weight may move the fingers either way; none if it is balanced.

        They are along the jaws' motion and the approach. closing (3,): unit vector, in the frame of the tool's site,
        along which the jaws close.
        """
        model, geoms = self.model, self.robot.gripper_geoms[self.robot.geom_on_finger]
        if (model.body_gravcomp[model.geom_bodyid[geoms]] >= 1.0).all():
            return []
        site = self.data.site_xmat[self.robot.site].reshape(3, 3)
        return [self._gravity * site @ way for way in (closing, (0.0, 0.0, 1.0))]

    def rest(self, sweep: GripperSweep, references: FloatArray, weight: FloatArray) -> FloatArray:
        """Return the closures (n,) at rest at `references` (n,), rising, under the acceleration `weight` (3,)."""
        controls = sweep.controls[0] + references[:, None] * (sweep.controls[-1] - sweep.controls[0])
        self.model.opt.gravity[:] = weight
        closures = np.array([(self.lengths(one) - sweep.lengths[0]) @ sweep.per_length for one in controls])
        self.model.opt.gravity[:] = 0.0
        return closures

    def moving_ends(self, sweep: GripperSweep) -> tuple[FloatArray, FloatArray]:
        """Return those inputs (g,) of a sweep between which each actuator moves its fingers, found by bisection."""
        shares, lengths = np.linspace(0.0, 1.0, _SAMPLES), sweep.lengths
        first, last = sweep.controls[0], sweep.controls[-1]
        low, high = _dead(shares, lengths), 1.0 - _dead(1.0 - shares[::-1], lengths[::-1])[:, ::-1]
        # For each actuator: (unmoved, moved) at the first end, (moved, unmoved) at the last one.
        ends = np.stack([low, high], axis=1)
        moved = _UNMOVED * np.ptp(lengths, axis=0)
        while True:
            least = np.maximum(_FINE * (ends[:, 1, 1] - ends[:, 0, 0]), _FINEST)
            widths = np.ptp(ends, axis=2) / least[:, None]
            actuator, end = np.unravel_index(widths.argmax(), widths.shape)
            if widths[actuator, end] <= 1.0:
                return first + ends[:, 0, 0] * (last - first), first + ends[:, 1, 1] * (last - first)
            share = float(ends[actuator, end].mean())
            at = self.lengths(first + share * (last - first))
            for one, (near, far) in enumerate(ends):
                if near[0] < share < near[1]:
                    near[int(abs(at[one] - lengths[0, one]) > moved[one])] = share
                if far[0] < share < far[1]:
                    far[int(abs(at[one] - lengths[-1, one]) <= moved[one])] = share


def _swings(recent: FloatArray) -> bool:
    """Return whether that finger whose positions (n, f) change most turns round often, and as far as before."""
    widest = recent[:, np.ptp(recent, axis=0).argmax()]
    first, second = (float(np.ptp(half)) for half in np.array_split(widest, 2))
    turns = np.count_nonzero(np.diff(np.sign(np.diff(widest))))
    return bool(second > 0.5 * first and turns >= _TURNS)


def _dead(shares: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return the shares (g, 2) between which each actuator begins to move; (0, 0) if it does so from the first one."""
    steps = np.abs(np.diff(lengths, axis=0))
    travels = np.ptp(lengths, axis=0)
    moved = (np.abs(lengths - lengths[0]) > _UNMOVED * travels).argmax(axis=0)
    even = (steps[0] >= _EVEN * steps.max(axis=0)) | (travels < _SMALLEST)
    return np.where(even[:, None], 0.0, np.column_stack([shares[moved - 1], shares[moved]]))
