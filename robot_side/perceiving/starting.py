"""Start of the process that maps depth pictures, by the robot side's settings."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Final

from common.sockets.door.messages import DoorSettings, DriverSettings
from robot_side.depth.camera_settings import DEPTH_PORT
from robot_side.drivers.remote.depth_message import DEPTH_LIMIT_BYTES
from robot_side.perceiving.exchange import Loaded, Setup
from robot_side.perceiving.object_source import surface_frames
from robot_side.perceiving.surfaces import Surfaced
from robot_side.settings import RobotSettings

_BYTES_PER_S: Final = 64e6
"""Budget of each camera: 848 x 480 pixels with labels at 30 Hz, and some more"""


def setup_of(settings: RobotSettings) -> Setup:
    """Return what the process that maps pictures needs to know."""
    model = None if settings.model is None else str(settings.model.absolute())
    name = settings.scene or "table"
    scene = Loaded(model, settings.site, dict(settings.roles), name, settings.seed, settings.site_axis)
    encoder = settings.encoder.sigma_rad, settings.encoder.resolution_rad
    port = None
    if settings.depth is not None:
        driver = DriverSettings(settings.depth, "perception", DEPTH_LIMIT_BYTES, _BYTES_PER_S)
        keys = None if settings.keys is None else str(settings.keys)
        port = DoorSettings(settings.bind, None, {DEPTH_PORT: driver}, insecure=settings.insecure, keys=keys)
    return Setup(scene, settings.depth_camera, settings.depth_map, settings.depth_mounts, encoder, port, settings.seed)


@contextmanager
def surfaced(settings: RobotSettings, note: Callable[[str], None], now_s: float) -> Iterator[Surfaced | None]:
    """Yield the source of what depth cameras see; None if the settings want none. note: as for Surfaced.

    The companion process starts at once, and so loads and compiles beside the robot side's own start.
    """
    if not settings.by_depth:
        yield None
        return
    source = Surfaced(setup_of(settings), partial(surface_frames, settings), note)
    source.begin(now_s)
    try:
        yield source
    finally:
        source.close()
