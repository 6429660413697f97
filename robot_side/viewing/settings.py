"""What a person may set about pictures."""

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.limits import check_limits

_Pixels = Annotated[int, Meta(ge=16, le=4096)]


@dataclass(frozen=True)
class CamerasSettings:
    """The two views, rendered while somebody looks at them, in a process of their own."""

    on: Annotated[bool, tyro.conf.arg(name="cameras", prefix_name=False)] = True
    """Render what somebody looks at; without it nobody sees pictures, and the arm is felt and driven all the same."""
    width: _Pixels = 640
    """Pixels of each picture."""
    height: _Pixels = 480
    rate_hz: Annotated[float, Meta(ge=0.1, le=120.0)] = 30.0
    """Pictures of each view in a second."""
    quality: Annotated[int, Meta(ge=1, le=100)] = 75
    """1 to 100: 75 is 20 kB for each picture as JPEG, more than 90 three times that; 1 to 2 kB as H.264."""
    codec: Literal["auto", "jpeg"] = "auto"
    """auto: H.264 where PyAV is installed here and with all who look, and nothing is recorded here; else JPEG."""

    def __post_init__(self) -> None:
        check_limits(self)
