"""Settings of the pictures of both views."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.limits import check_limits
from robot_side.viewing.mount import MountSettings

_Pixels = Annotated[int, Meta(ge=16, le=4096)]


@dataclass(frozen=True)
class CamerasSettings:
    """Pictures of the two views, rendered in a separate process while somebody watches them."""

    on: Annotated[bool, tyro.conf.arg(name="cameras", prefix_name=False)] = True
    """Render the watched views. Without pictures the arm can be felt and driven all the same."""
    width: _Pixels = 640
    """Width of each picture, in pixels."""
    height: _Pixels = 480
    rate_hz: Annotated[float, Meta(ge=0.1, le=120.0)] = 30.0
    """Number of pictures of each view in a second."""
    quality: Annotated[int, Meta(ge=1, le=100)] = 75
    """Quality of pictures, 1 to 100. At 75 a picture takes 20 kB as JPEG, or 1 to 2 kB as H.264; above 90, three times
    as much as JPEG."""
    codec: Literal["auto", "jpeg"] = "auto"
    """Codec of pictures. auto: H.264 if PyAV is here and at all viewers, and nothing is recorded here; else JPEG."""

    at_once: bool = False
    """Start the drawing process together with the robot side, as somebody will soon watch."""

    mount: Annotated[MountSettings, tyro.conf.Suppress] = field(default_factory=MountSettings)
    """Only in a TOML file: where the cameras of --pictures are, for what the page draws over their pictures."""

    def __post_init__(self) -> None:
        check_limits(self)
