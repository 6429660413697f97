"""Pictures of depth cameras for some seconds, from a port or simulated, beside an arm that nobody moves."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Final, NamedTuple

from common.errors import ConfigurationError, FeelaheadError
from robot_side.commissioning.arm_alone import ArmAlone
from robot_side.commissioning.depth_figures import LookedAt, PictureFigures
from robot_side.commissioning.procedure import StoppedError
from robot_side.compiled.kernel import imported_kernels
from robot_side.compiled.warm_up import warm_up
from robot_side.depth.sensors import SENSORS
from robot_side.drivers.mujoco.depth_cameras.eyes import simulated_eyes
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot, RobotParts
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.drawing.off_screen import REMEDY
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.remote.depth import RemoteDepth
from robot_side.perceiving.exchange import Joints
from robot_side.perceiving.taking import SentPictures, SimulatedPictures, Taking

_FIRST_S: Final = 30.0
"""Time for which the first picture is waited for"""
_KERNELS: Final = "robot_side.depth.support."


class Watched(NamedTuple):
    """What some seconds brought."""

    figures: dict[str, list[PictureFigures]]
    """Figures of each picture, by the camera's name"""
    refused: dict[str, int]
    """Number of refused pictures by reason"""


def watch_depth(one: ArmAlone, seconds: float, say: Callable[[str], None]) -> Watched:
    """Look at the pictures of the settings' cameras, for `seconds` from the first one on.

    Without a picture it ends after 30 s. ConfigurationError for mounts on links that the model lacks, and where nothing
    can be rendered. StoppedError if a person ends it.
    """
    warm_up(kernels=[kernel for kernel in imported_kernels() if kernel.name.startswith(_KERNELS)])
    looked, scene = LookedAt(), one.parts.scene
    with ExitStack() as stack:
        remote: RemoteDepth | None = None
        if one.depth is None:
            pictures: Taking = stack.enter_context(_simulated(one, looked))
            eyes = simulated_eyes(scene, one.settings.depth_camera.eyes)
            numbers = {eye.name: number for number, eye in enumerate(eyes)}
        else:
            remote = RemoteDepth(one.depth, say)
            pictures = sent = _sent(one, remote, looked)
            numbers = sent.cameras
            say(f"waiting for depth pictures at {one.depth.endpoint}")
        robot, start = scene.robot, scene.data.qpos
        arm_rad, fingers = start[robot.arm_positions], start[robot.finger_positions]
        end_s = one.pace.wait() + _FIRST_S
        while (now_s := one.pace.wait()) < end_s:
            if one.pace.stopped:
                raise StoppedError("ended by a person")
            measured_s = now_s
            if not one.simulated:
                state = one.arm.state(now_s)
                arm_rad, fingers, measured_s = state.joint_positions_rad, state.finger_positions, state.time_s
            pictures.hear(Joints(measured_s, arm_rad.tobytes(), fingers.tobytes(), b"", scene.data.qpos.tobytes()))
            looked.now_s, known = now_s, set(looked.figures)
            pictures.step(now_s)
            new = looked.figures.keys() - known
            if new and not known:
                end_s = now_s + seconds
    refused = {} if remote is None else {str(why): count for why, count in remote.senders.rejected.items()}
    return Watched(
        {name: looked.figures[number] for name, number in numbers.items() if number in looked.figures}, refused
    )


def _sent(one: ArmAlone, remote: RemoteDepth, looked: LookedAt) -> SentPictures:
    scene, settings = one.parts.scene, one.settings
    robot = PosedRobot(scene.model, RobotParts.of(scene.robot), scene.data.qpos)
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
