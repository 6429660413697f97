"""Telling tests of the map in simulated scenes: see `telling`."""

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from shutil import copy
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from common.arrays import FloatArray
from feelahead.both_sides.grasping_trial import MISJUDGES_DEPTH, Trial, Watch
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.interleaved import processor_us
from feelahead.lab.posed_gripper import PosedGripper
from robot_side.arm.port import GripperPose
from robot_side.depth.camera_settings import DepthCameraSettings
from robot_side.depth.frames import SurfaceFrames
from robot_side.depth.settings import MapSettings
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.depth_cameras.source import SimulatedDepth
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.enlargement.distance import Uncertainty, standard_quantile
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.object_class import OBSTACLE
from robot_side.field.object_errors import largest_errors, object_errors
from robot_side.settings import EncoderSettings
from robot_side.surroundings.distances import object_distances
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, scene_table
from robot_side.surroundings.surroundings import Surroundings

Rows = Iterator[tuple[str, str]]
_RATE_HZ: Final = 15.0
_ENCODER: Final = Encoder(EncoderSettings().sigma_rad, EncoderSettings().resolution_rad)
_GHOST_M: Final = 0.015
_QUANTILE: Final = float(standard_quantile(0.9))
_ALARM: Final = 4
_UNUSED_M: Final = -100.0
"""Height below which unused boxes are parked"""


def frozen(name: str) -> Scene:
    """Return a frozen scene."""
    return load_scene(frozen_scene(name), SITE)


class Seen:
    """A scene that two cameras look at, and what is perceived of it."""

    def __init__(self, scene: Scene, mount_error_m: float, sd_m: float, seed: int = 0) -> None:
        settings = DepthCameraSettings(mount_error_m=mount_error_m, labels=False, rate_hz=_RATE_HZ)
        self.scene, self.posed = scene, PosedScene(scene)
        self.home_rad: FloatArray = scene.data.qpos[scene.robot.arm_positions].copy()
        self.fingers: FloatArray = scene.data.qpos[scene.robot.finger_positions].copy()
        self.rig = DepthRig(scene, settings, MapSettings(), _ENCODER, seed)
        self.frames = SurfaceFrames(MapSettings().slots, sd_m, 0.0)
        self.taken = 0

    def look(self, joints_rad: FloatArray | None = None, shift_m: FloatArray | None = None, times: int = 1) -> None:
        """Take pictures with the arm at these joints, and all objects moved."""
        joints_rad = self.home_rad if joints_rad is None else joints_rad
        self.posed.set_pose(joints_rad, self.fingers, np.zeros(3) if shift_m is None else shift_m)
        for _ in range(times):
            now_s = self.taken / _RATE_HZ
            self.rig.take(self.posed.data, now_s, self.scene.roles)
            if (news := self.rig.arrived(now_s + self.rig.latency_s)) is not None:
                self.frames.take(news[0], (news[1], news[1]))
            self.taken += 1

    def true(self) -> PerceivedObjects:
        """Return the objects as they are."""
        return self.posed.perceived(np.zeros((len(self.scene.objects), 3)))


def _surfels_m(rig: DepthRig) -> FloatArray:
    """Return the points (n, 3) of the map's surfels."""
    surfels = rig.perception._map.surfels
    points_m: FloatArray = surfels.table.points_m[surfels.shown]
    return points_m


def distances_m(points_m: FloatArray, objects: SceneTable, most_m: float) -> FloatArray:
    """Return the distance of each point (n,) from the nearest object, at most `most_m`."""
    none = np.zeros(1)
    least = [object_distances(point[None], none, objects, most_m).min(initial=most_m) for point in points_m]
    return np.array(least)


def _look(ahead: Ahead, pose: GripperPose, objects: PerceivedObjects, sd_m: float, reach_m: float) -> FloatArray:
    """Return the fast list (8,) along the approach."""
    uncertainty = Uncertainty(0.9, camera_sd_m=sd_m)
    of_objects = object_errors(objects, uncertainty)
    unseen_m, variance_m2 = largest_errors(of_objects, uncertainty)
    axis = np.ascontiguousarray(pose.tool_rotation[:, 2])
    along = Along(axis, 0.0, variance_m2, _QUANTILE, reach_m, unseen_m=unseen_m, of_objects=of_objects)
    return ahead.look(pose, scene_table(objects), np.full(len(objects.names), OBSTACLE), along).fast_m


def look_cost() -> Rows:
    """Yield the cost of a look at a wall ahead, and of a frame's changes, as a multiple of the true wall's."""
    scene = frozen("wall")
    seen, gripper = Seen(scene, 0.002, 0.003), PosedGripper(scene)
    shift_m = np.array([-0.25, 0.0, 0.0])
    seen.look(shift_m=shift_m, times=15)
    pose, ahead = gripper.at(gripper.home_rad), Ahead(np.full(len(gripper.home_rad), 2e-4))
    along = Along(np.ascontiguousarray(pose.tool_rotation[:, 2]), 0.0, 9e-6, _QUANTILE, 0.4)
    surroundings, took_us = Surroundings(), list[float]()
    for _ in range(30):
        seen.look(shift_m=shift_m)
        frame, begin_s = seen.frames.at(0.0), time.thread_time()
        surroundings.see(frame)
        took_us.append(1e6 * (time.thread_time() - begin_s))
    seen.rig.close()
    tables = {"true": scene_table(seen.true()), "map": surroundings.see(frame)}

    def look(table: SceneTable) -> None:
        ahead.look(pose, table, np.full(len(table.objects.names), OBSTACLE), along)

    cost_us = processor_us({name: partial(look, table) for name, table in tables.items()}, 40)
    yield (
        f"a wall 70 mm ahead, {int((frame.box_centers_m[:, 2] > _UNUSED_M).sum())} boxes, pictures going on",
        f"a look costs {cost_us['map'] / cost_us['true']:.1f} times that at the true wall ({cost_us['true']:.0f} us);"
        f" taking a picture's changes {np.median(took_us) / cost_us['true']:.1f} times",
    )


def clearances() -> Rows:
    """Yield from which clearance on fingers pass a post, and a mug between them, without strength 4."""
    for sd_m, mount_m in ((0.001, 0.0), (0.003, 0.002)):
        for name, reach_m in (("post", 0.115), ("mug", 0.29)):
            least = {"true": 0, "map": 0}
            for clear_mm in range(21, 4, -2):
                scene, shift_m = passed(name, clear_mm)
                gripper = PosedGripper(scene)
                pose, ahead = gripper.at(gripper.home_rad), Ahead(np.full(len(gripper.home_rad), 2e-4))
                for seed in range(3):
                    seen = Seen(scene, mount_m, sd_m, seed)
                    seen.look(shift_m=shift_m, times=15)
                    seen.rig.close()
                    for kind, objects in (("true", seen.true()), ("map", seen.frames.at(0.0))):
                        if _look(ahead, pose, objects, sd_m, reach_m)[_ALARM - 1] < np.inf:
                            least[kind] = max(least[kind], clear_mm + 2)
            yield (
                f"fingers pass a {name}, sd {1e3 * sd_m:g} mm, mounts wrong by {1e3 * mount_m:g} mm",
                f"no strength 4 from {least['map']} mm of clearance on (the true one: {least['true'] or 5})",
            )


def passed(name: str, clear_mm: float) -> tuple[Scene, FloatArray]:
    """Return a scene with something that the fingers pass at this clearance, and where to move it (3,)."""
    if name == "post":
        # The posts begin 170 mm ahead, 20 mm beside the fingers.
        return frozen("slot"), np.array([-0.11, -1e-3 * (20.0 - clear_mm), 0.0])
    # The mug of 70 mm has 9 mm on each side; the palm meets its rim after 320 mm.
    text, scale = frozen_scene("mug").read_text(encoding="utf-8"), 1e-3 * (44.0 - clear_mm) / 35.0
    with TemporaryDirectory() as folder:
        copy(frozen_scene("arm"), folder)
        path = Path(folder) / "mug.xml"
        path.write_text(text.replace('scale="0.001 0.001', f'scale="{scale} {scale}'), encoding="utf-8")
        return load_scene(path, SITE), np.zeros(3)


def drive() -> Rows:
    """Yield what stands where nothing is, while the arm moves over a table for 60 s."""
    for mount_m in (0.0, 0.002, 0.006):
        scene = load_scene()
        seen, gripper = Seen(scene, mount_m, 0.003), PosedGripper(scene)
        seen.posed.set_pose(seen.home_rad, seen.fingers, np.zeros(3))
        true = scene_table(seen.true())
        told, least_m = [], np.inf
        for number in range(round(60.0 * _RATE_HZ)):
            joints_rad = seen.home_rad + swing(number / _RATE_HZ, len(seen.home_rad))
            seen.look(joints_rad)
            least_m = min(least_m, seen.posed.gap_m())
            if (number + 1) / _RATE_HZ in (10.0, 30.0, 60.0):
                points_m = _surfels_m(seen.rig)
                ghosts_m = points_m[distances_m(points_m, true, 0.1) > _GHOST_M]
                pose = gripper.at(joints_rad)
                away_m = np.linalg.norm(ghosts_m[:, None] - pose.sphere_centers_m, axis=2) - pose.sphere_radii_m
                own = int((away_m.min(axis=1, initial=1.0) < 0.02).sum())
                told.append(f"{len(ghosts_m)} of {len(points_m)} ({own})")
        seen.rig.close()
        yield (
            f"60 s over a table, mounts wrong by {1e3 * mount_m:g} mm, least gap {1e3 * least_m:.0f} mm",
            f"surfels over 15 mm from any surface (of these at the gripper) at 10, 30, 60 s: {', '.join(told)}",
        )


def swing(time_s: float, joints: int) -> FloatArray:
    """Return by how much the joints (n,) differ from home."""
    reach_rad = np.array([0.5, 0.08, 0.08, 0.15, 0.25, 0.5, 0.5])[:joints]
    rates_rad_s = np.array([0.5, 0.7, 0.9, 0.6, 0.8, 0.4, 0.3])[:joints]
    return reach_rad * np.sin(rates_rad_s * time_s)


def held() -> Rows:
    """Yield what of the map is in the way of the held target, while a simulated person carries it."""
    person = replace(MISJUDGES_DEPTH, depth_error_sd_m=0.0, depth_error_mean_m=0.0)
    watch = Watch(Trial("table", "", "reacting", person, 45.0, camera_sd_m=0.003, by_depth=True), 0)
    scene, loop, source = watch.scene, watch.loopback, watch.episode.parts.camera
    assert isinstance(source, SimulatedDepth)
    target, none = [thing.name for thing in scene.objects].index("target"), np.zeros((len(scene.objects), 3))
    counts: list[int] = []
    while loop.clock.now() < 45.0 and (loop.robot.held is not None or not counts):
        loop.run_until(loop.clock.now() + 0.2)
        if loop.robot.held is not None and source._rig is not None:
            places = scene.data.geom_xpos, scene.data.geom_xmat
            true = scene_table(scene.primitives.perceived(0.0, scene.roles, none, *places))
            points_m = _surfels_m(source._rig)
            away_m = np.array([object_distances(point[None], np.zeros(1), true, 0.1) for point in points_m])
            others_m = np.delete(away_m, target, axis=1).min(axis=1)
            counts.append(int(((away_m[:, target] < 0.05) & (others_m > _GHOST_M)).sum()))
    assert counts, "the person did not grasp the target"
    yield (
        f"the target is held and carried for {0.2 * len(counts):.0f} s",
        "surfels within 50 mm of it and over 15 mm from all else:"
        f" {np.median(counts):g} ({min(counts)} to {max(counts)})",
    )
