"""Settings of depth cameras: those that are simulated, and the mounts of all."""

from dataclasses import dataclass
from typing import Annotated, Final, Literal

import tyro
from msgspec import Meta

from common.limits import check_limits
from robot_side.depth.sensors import SENSORS
from robot_side.surroundings.mount import Mount

BY_DEPTH: Final = "depth"
"""Name of the perception by simulated depth cameras"""
DEPTH_PORT: Final = "--depth"
"""Flag of the port at which depth pictures arrive"""
Perception = Literal["objects", "depth"]
"""What experiments perceive: the objects themselves, or what depth cameras see of them"""
Eyes = Literal["fixed", "wrist", "both"]


@dataclass(frozen=True)
class LinkMount(Mount):
    """Mount of a camera on a link of the robot, or in the world."""

    link: str = "world"
    """Name of the body that carries the camera, or `world`"""


@dataclass(frozen=True)
class DepthCameraSettings:
    """Depth cameras: their errors, and how they are simulated with --perception depth."""

    eyes: Annotated[Eyes, tyro.conf.arg(metavar="{fixed,wrist,both}")] = "both"
    """With --perception depth: simulated cameras, beside and above the gripper, on it, or both."""
    sensor: Annotated[str, tyro.conf.arg(metavar="{d435,azure_kinect,ideal}")] = "d435"
    """Camera whose errors are simulated, or allowed for."""
    noise: Annotated[float, Meta(ge=0.0, le=10.0)] = 1.0
    """Factor of the simulated camera's errors; 0: none."""
    mount_error_m: Annotated[float, Meta(ge=0.0, le=0.1)] = 0.0
    """Distance by which the simulated cameras are elsewhere than believed; each mm turns them by 0.1 degrees."""
    labels: bool = True
    """Whether the simulated camera has a segmentation, which tells targets and supports."""
    known: tuple[str, ...] = ()
    """With --perception depth: objects whose models are known. They are felt as models, and taken out of the map."""
    width: Annotated[int, Meta(ge=32, le=1280)] = 320
    height: Annotated[int, Meta(ge=32, le=1024)] = 240
    rate_hz: Annotated[float, Meta(ge=1.0, le=90.0)] = 30.0
    """Pictures of each simulated camera in a second."""

    def __post_init__(self) -> None:
        check_limits(self)
        if self.sensor not in SENSORS:
            raise ValueError(f"sensor = {self.sensor!r}; valid: {', '.join(SENSORS)}")
