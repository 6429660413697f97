"""What a person may set about pictures."""

from dataclasses import dataclass
from typing import Annotated

import tyro


@dataclass(frozen=True)
class CamerasSettings:
    """The two views, rendered while somebody looks at them, in a process of their own."""

    on: Annotated[bool, tyro.conf.arg(name="cameras", prefix_name=False)] = True
    """Render what somebody looks at; without it nobody sees pictures, and the arm is felt and driven all the same."""
    width: int = 640
    """Pixels of each picture."""
    height: int = 480
    rate_hz: float = 30.0
    """Pictures of each view in a second."""
    quality: int = 75
    """Of JPEG, 1 to 100: 75 is 20 kB for each picture, more than 90 three times that."""

    def __post_init__(self) -> None:
        for name, value, least, most in (
            ("width", self.width, 16, 4096),
            ("height", self.height, 16, 4096),
            ("rate_hz", self.rate_hz, 0.1, 120.0),
            ("quality", self.quality, 1, 100),
        ):
            if not least <= value <= most:
                raise ValueError(f"cameras.{name} = {value}; valid: {least} to {most}")
