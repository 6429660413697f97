"""Sources of objects in this process, by the settings."""

import math
from functools import partial

from robot_side.depth.camera_settings import BY_DEPTH
from robot_side.depth.frames import SurfaceFrames
from robot_side.drivers.mujoco.camera import CameraError, MujocoCamera
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.scene import Scene
from robot_side.perceiving.known_models import Mapped, WithModels
from robot_side.perceiving.own_perception import perceived_by
from robot_side.settings import RobotSettings
from robot_side.surroundings.fixed_objects import fixed_objects
from robot_side.surroundings.perceived import ObjectSource


def surface_frames(settings: RobotSettings) -> SurfaceFrames:
    """Return empty frames of the surfaces that depth cameras see."""
    camera, fixed = settings.camera, fixed_objects(settings.workspace_m, settings.arm_keep_out)
    sd_m = math.hypot(camera.sd_m, camera.frame_sd_m)
    return SurfaceFrames(settings.depth_map.slots, sd_m, camera.unseen_m_s, fixed)


def source_of(settings: RobotSettings, scene: Scene, camera: MujocoCamera, seed: int) -> ObjectSource:
    """Return the source of the setting `perception`, in this process. camera: used unless it names another."""
    if settings.perception != BY_DEPTH:
        return perceived_by(settings.perception, camera)
    # Needs what renders pictures.
    from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig  # noqa: PLC0415
    from robot_side.drivers.mujoco.depth_cameras.source import SimulatedDepth  # noqa: PLC0415

    encoder = Encoder(settings.encoder.sigma_rad, settings.encoder.resolution_rad, seed)
    return SimulatedDepth(
        scene,
        lambda: DepthRig(scene, settings.depth_camera, settings.depth_map, encoder, seed),
        partial(surface_frames, settings),
    )


def with_known(
    settings: RobotSettings, mapped: ObjectSource, sent: ObjectSource | None, camera: ObjectSource
) -> ObjectSource:
    """Return the source of all objects, with the known models if there are any beside surfaces.

    mapped: what depth cameras see, or the simulation's source. sent: that of --objects. camera: the simulated one.
    """
    known = settings.depth_camera.known if settings.perception == BY_DEPTH else ()
    if isinstance(mapped, Mapped) and (sent is not None or known):
        return WithModels(mapped, sent or camera, None if sent is not None else known)
    return sent or mapped


def simulated_camera(settings: RobotSettings, scene: Scene, seed: int) -> MujocoCamera:
    """Return the simulated camera that perceives the objects themselves. seed: draws its errors."""
    error = settings.camera.mean_vector_m, settings.camera.sd_m, settings.camera.frame_sd_m
    return MujocoCamera(scene, CameraError(tuple(thing.name for thing in scene.objects), *error, seed))
