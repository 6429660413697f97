"""Pictures of depth cameras for some seconds, from a port or simulated, beside an arm that nobody moves."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Final, NamedTuple

import numpy as np

from common.errors import ConfigurationError, FeelaheadError
from robot_side.commissioning.arm_alone import ArmAlone
from robot_side.commissioning.depth_figures import Look, LookedAt, PictureFigures
from robot_side.commissioning.procedure import StoppedError
from robot_side.compiled.kernel import imported_kernels
from robot_side.compiled.warm_up import warm_up
from robot_side.depth.camera_settings import LinkMount
from robot_side.depth.sensors import SENSORS
from robot_side.drivers.mujoco.depth_cameras.eyes import simulated_eyes
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot, RobotParts
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.drawing.off_screen import REMEDY
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.remote.depth import RemoteDepth
from robot_side.perceiving.exchange import Joints
from robot_side.perceiving.taking import SentPictures, SimulatedPictures, Taking

_TOUR, _TOUR_RAD = 5, 0.2
"""Poses that a simulated arm takes, and how far its joints are from their start, at most"""
_FIRST_S: Final = 30.0
"""Time for which the first picture is waited for"""
_KERNELS: Final = "robot_side.depth.support."


class Watched(NamedTuple):
    """What some seconds brought."""

    figures: dict[str, list[PictureFigures]]
    """Figures of each picture, by the camera's name"""
    refused: dict[str, int]
    """Number of refused pictures by reason"""
    looks: dict[str, list[Look]]
    """Pictures from different poses of the arm, by the camera's name"""
    mounted: dict[str, LinkMount]
    """Where the cameras are taken to be"""


def watch_depth(one: ArmAlone, seconds: float, say: Callable[[str], None], *, poses: bool = False) -> Watched:
    """Look at the pictures of the settings' cameras, for `seconds` from the first one on.

    poses: pictures of several poses are wanted. An arm that is simulated with its cameras takes them; else a person is
    asked to move it.

    Without a picture it ends after 30 s. ConfigurationError for mounts on links that the model lacks, and where nothing
    can be rendered. StoppedError if a person ends it.
    """
    warm_up(kernels=[kernel for kernel in imported_kernels() if kernel.name.startswith(_KERNELS)])
    looked, scene = LookedAt(), one.parts.scene
    with ExitStack() as stack:
        remote: RemoteDepth | None = None
        if one.depth is None:
            pictures: Taking = (simulated := stack.enter_context(_simulated(one, looked)))
            eyes = simulated_eyes(scene, one.settings.depth_camera.eyes)
            numbers = {eye.name: number for number, eye in enumerate(eyes)}
            mounted = simulated.mounted
        else:
            remote = RemoteDepth(one.depth, say)
            pictures = sent = _sent(one, remote, looked)
            numbers, mounted = sent.cameras, sent.mounted
            say(f"waiting for depth pictures at {one.depth.endpoint}")
        robot, start = scene.robot, scene.data.qpos
        arm_rad, fingers = start[robot.arm_positions], start[robot.finger_positions]
        tour_rad = arm_rad + _TOUR_RAD * np.random.default_rng(0).uniform(-1.0, 1.0, (_TOUR, len(arm_rad)))
        positions, kept = start.copy(), 0
        if poses and not one.simulated:
            say("move the arm by its own pendant: five poses in the pictures, and a second of rest in each")
        end_s = one.pace.wait() + _FIRST_S
        while (now_s := one.pace.wait()) < end_s:
            if one.pace.stopped:
                raise StoppedError("ended by a person")
            measured_s = now_s
            if not one.simulated:
                state = one.arm.state(now_s)
                arm_rad, fingers, measured_s = state.joint_positions_rad, state.finger_positions, state.time_s
            elif poses and one.depth is None and looked.figures:
                arm_rad = tour_rad[int(max(0.0, 1.0 - (end_s - now_s) / seconds) * _TOUR)]
                positions[robot.arm_positions] = arm_rad
            joints = arm_rad.tobytes(), fingers.tobytes()
            pictures.hear(Joints(measured_s, *joints, b"", positions=positions.tobytes()))
            looked.stand(measured_s, arm_rad, fingers)
            looked.now_s, known = now_s, set(looked.figures)
            pictures.step(now_s)
            if poses and (count := sum(map(len, looked.looks.values()))) > kept:
                kept = count
                say(f"pictures of an arm at rest: {kept}")
            new = looked.figures.keys() - known
            if new and not known:
                end_s = now_s + seconds
                if remote is not None:
                    del remote.senders.rejected["late"]  # they had come before this could look
    refused = {} if remote is None else {str(why): count for why, count in remote.senders.rejected.items()}
    seen = {name: number for name, number in numbers.items() if number in looked.figures}
    figures = {name: looked.figures[number] for name, number in seen.items()}
    return Watched(figures, refused, {name: looked.looks[number] for name, number in seen.items()}, mounted)


def posed_robot(one: ArmAlone) -> PosedRobot:
    """Return the arm's robot, to be set into poses."""
    scene = one.parts.scene
    return PosedRobot(scene.model, RobotParts.of(scene.robot), scene.data.qpos)


def _sent(one: ArmAlone, remote: RemoteDepth, looked: LookedAt) -> SentPictures:
    settings, robot = one.settings, posed_robot(one)
    robot.require_links(mount.link for mount in settings.depth_mounts.values())
    errors = SENSORS[settings.depth_camera.sensor].depth_errors(settings.depth_camera.noise)
    return SentPictures(remote, robot, settings.depth_mounts, lambda: looked, errors)


@contextmanager
def _simulated(one: ArmAlone, looked: LookedAt) -> Iterator[SimulatedPictures]:
    scene, settings = one.parts.scene, one.settings
    encoder = Encoder(settings.encoder.sigma_rad, settings.encoder.resolution_rad, settings.seed)
    try:
        rig = DepthRig(scene, settings.depth_camera, settings.depth_map, encoder, settings.seed)
    except FeelaheadError:
        raise
    except Exception as error:  # the graphics library's are of many kinds
        raise ConfigurationError(f"no depth can be rendered here: {error}; to mend it: {REMEDY}") from None
    rig.perception = looked
    try:
        yield SimulatedPictures(scene, rig)
    finally:
        rig.close()
