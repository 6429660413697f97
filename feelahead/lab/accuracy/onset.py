"""Distances that looks find: with finer and coarser covers, older looks, and from more and fewer places.

Errors of cameras and encoders are left out, so that D_σ = 0 and what remains is the method's own error: a distance less
that which the true gripper can go. Two distances are judged. The *contact distance* d is where the first sphere
touches; peers find it, too. The *onset of full strength* is what the law uses: s(D) = 1 from D = d on, and sooner where
spheres are so small that they are swallowed within the margin m.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.periods import TURN_S
from feelahead.lab.accuracy.placements import REACH_M, Placement, as_meshes
from feelahead.lab.accuracy.points import Part, each, point
from feelahead.lab.interleaved import processor_us
from feelahead.lab.reference.solids import Solids
from feelahead.lab.table import Row
from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.object_class import OBSTACLE
from robot_side.laws.path import Drift, Waypoint, at_waypoint
from robot_side.settings import RobotSettings
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, scene_table

UNIT: Final = "mm of onset"
_TRUTH: Final = "true geometry"
CONTACT: Final = Part("contact distance", UNIT, _TRUTH)
FULL: Final = Part("full strength", UNIT, _TRUTH)
BETWEEN: Final = Part("full strength, 4 ms of looks", UNIT, _TRUTH)
_DENSE: Final = 48
PATH: Final = Part("full strength, curved path", UNIT, f"looks from {1 + _DENSE} places")
COVERS_MM: Final = (1, 2, 3, 5, 10)
AGES_MS: Final = (4, 8, 10, 20, 40)
PLACES: Final = (0, 1, 2, 4, 8)
_BUILT_COVER_MM: Final = 1e3 * RobotSettings().cover_m
_BUILT_AGE_MS: Final = 8
"""Period of the looks along the side that leads (`laws/swept.py`)"""
_AHEAD_M_S: Final = 0.24
_PATH_S: Final = 0.6
_KNOWN_MM: Final = 0.01

Method = Callable[[Placement], float]
"""Function that returns the contact distance in m"""


def covered(placement: Placement, stand_out_m: float) -> GripperPose:
    """Return the same gripper in spheres that stand out by at most `stand_out_m`."""
    scene = placement.scene
    joints = scene.data.qpos[scene.robot.arm_positions]
    state = ArmState(
        0.0, joints.copy(), np.zeros_like(joints), scene.data.qpos[scene.robot.finger_positions], 0.0, False
    )
    return MujocoKinematics(scene, stand_out_m).pose(state)


class Looks:
    """Looks without errors along û, whose result is the onset distance of full strength."""

    def __init__(self, placement: Placement) -> None:
        joints = placement.pose.tool_jacobian.shape[1]
        self._ahead = Ahead(np.zeros(joints))
        self._classes = np.full(len(placement.scene.objects), OBSTACLE, dtype=np.int64)

    def onset_m(self, pose: GripperPose, seen: SceneTable, direction: FloatArray) -> float:
        """Look along `direction` (3,), a unit vector."""
        found = self._ahead.look(pose, seen, self._classes, Along(direction, 0.0, 0.0, 0.0, REACH_M))
        return min(float(found.fast_m[-1]), REACH_M)


@dataclass(frozen=True)
class Setting:
    """Looks of one setting at all places."""

    knob: str
    name: str
    pose: GripperPose
    seen: Sequence[PerceivedObjects]
    built: bool = False

    def onsets(self, looks: Looks, axis: FloatArray) -> list[Callable[[], float]]:
        """Return the looks; each returns the onset distance of full strength."""
        return [partial(looks.onset_m, self.pose, scene_table(seen), axis) for seen in self.seen]

    def contacts_m(self, axis: FloatArray) -> FloatArray:
        """Return the distance (n,) at which the first sphere touches, at each place, to 0.1 mm."""
        return np.array([first_touch_m(self.pose, seen, axis) for seen in self.seen])


def first_touch_m(pose: GripperPose, seen: PerceivedObjects, axis: FloatArray) -> float:
    """Return the distance along û at which the first sphere of the gripper touches any object."""
    solids, count, least_m = Solids(seen), len(pose.sphere_radii_m), REACH_M
    for thing in range(len(seen.names)):
        things, ends_m = np.full(count, thing), np.full(count, least_m)
        touches_m = solids.first_touch_m(pose.sphere_centers_m, pose.sphere_radii_m, things, axis, ends_m)
        least_m = min(least_m, float(touches_m.min()))
    return least_m


def settings(placements: Sequence[Placement]) -> Iterator[Setting]:
    """Yield the settings of looks: covers, and what stands for the objects."""
    seen = [there.seen for there in placements]
    for stand_out_mm in COVERS_MM:
        pose = covered(placements[0], 1e-3 * stand_out_mm)
        name = f"{stand_out_mm} mm, {len(pose.sphere_radii_m)} spheres"
        yield Setting("cover's stand-out", name, pose, seen, built=stand_out_mm == _BUILT_COVER_MM)
    yield Setting("objects as", "meshes", placements[0].pose, [as_meshes(one) for one in seen])


def older(placements: Sequence[Placement], age_s: float) -> FloatArray:
    """Return errors (n,) in m of onset distances that are `age_s` old, less the motion along û as in the law.

    The gripper moves at 0.24 m/s along û and at the stick's full speed across it.
    """
    aside_m_s, errors_m, looks = ToolMotionSettings().stick_speed_m_s, [], Looks(placements[0])
    for number, there in enumerate(placements):
        across = there.pose.tool_rotation[:, number % 2]
        moved_m = age_s * (_AHEAD_M_S * there.axis + aside_m_s * across)
        found_m = looks.onset_m(there.pose, there.table, there.axis) - float(there.axis @ moved_m)
        errors_m.append(found_m - there.seen_after(moved_m).contact_distance_m(REACH_M))
    return np.array(errors_m)


def curved(looks: Looks, there: Placement, number: int, places: int) -> float:
    """Return the least onset distance along R2 from 1 + `places` poses, as the gripper turns and moves aside."""
    look = looks.onset_m
    drift, found_m = drift_of(there, number), look(there.pose, there.table, there.axis)
    for after_s in _PATH_S * (1.0 + np.arange(places)) / max(places, 1):
        pose, chord = at_waypoint(there.pose, Waypoint(drift, after_s, after_s), 0.0)
        length = float(np.linalg.norm(chord))
        found_m = min(found_m, look(pose, there.table, chord / length) / length)
    return min(found_m, REACH_M)


def drift_of(there: Placement, number: int) -> Drift:
    """Return a motion by both sticks at full deflection: aside or upwards, turning against it."""
    motion, turn = ToolMotionSettings(), there.pose.tool_rotation
    sign = 1.0 if number % 4 < 2 else -1.0
    across, about = turn[:, number % 2], turn[:, 1 - number % 2]
    return Drift(sign * motion.stick_speed_m_s * across, sign * motion.turn_speed_rad_s * about)


def _sizes_mm(errors_m: FloatArray) -> FloatArray:
    """Return the sizes (n,) of errors in mm. The truths are known to 0.01 mm, and no error counts as less."""
    return np.maximum(1e3 * np.abs(errors_m), _KNOWN_MM)


def measure(placements: Sequence[Placement], rounds: int, peers: Mapping[tuple[str, str], Method]) -> Iterator[Row]:
    """Measure all looks and peers (by knob and setting) at the same places, in turns."""
    looks, axis = Looks(placements[0]), placements[0].axis
    own = {(one.knob, one.name): one for one in settings(placements)}
    works: dict[tuple[str, str], Sequence[Callable[[], float]]] = {
        **{key: one.onsets(looks, axis) for key, one in own.items()},
        **{key: [partial(method, there) for there in placements] for key, method in peers.items()},
    }
    truths_m = np.array([min(there.true_m, REACH_M) for there in placements])
    found_m = {key: np.array([min(do(), REACH_M) for do in dos]) for key, dos in works.items()}
    errors_mm = {key: _sizes_mm(some_m - truths_m) for key, some_m in found_m.items()}
    times_us = processor_us({key: each(dos) for key, dos in works.items()}, rounds)
    us = {key: time_us / len(placements) for key, time_us in times_us.items()}
    for key, one in own.items():
        contacts_mm = _sizes_mm(one.contacts_m(axis) - truths_m)
        yield point(CONTACT, *key, us[key], contacts_mm, built=one.built)
    for key in peers:
        yield point(CONTACT, *key, us[key], errors_mm[key], ours=False)
    for key, one in own.items():
        yield point(FULL, *key, us[key], errors_mm[key], built=one.built)
    look_us = next(us[key] for key, one in own.items() if one.built)
    for age_ms in AGES_MS:
        us_a_turn, aged_mm = look_us * 1e3 * TURN_S / age_ms, _sizes_mm(older(placements, 1e-3 * age_ms))
        yield point(BETWEEN, "age of a look", f"{age_ms} ms", us_a_turn, aged_mm, built=age_ms == _BUILT_AGE_MS)


def measure_paths(placements: Sequence[Placement], rounds: int) -> Iterator[Row]:
    """Measure looks from more and fewer places of curved paths, in turns."""
    looks = Looks(placements[0])
    works = {str(n): [partial(curved, looks, there, k, n) for k, there in enumerate(placements)] for n in PLACES}
    truths_m = np.array([curved(looks, there, number, _DENSE) for number, there in enumerate(placements)])
    times_us = processor_us({name: each(dos) for name, dos in works.items()}, rounds)
    for name, dos in works.items():
        errors_mm = _sizes_mm(np.array([do() for do in dos]) - truths_m)
        us, built = times_us[name] / len(placements), name == str(PLACES[-1])
        yield point(PATH, "places", name, us, errors_mm, built=built)
