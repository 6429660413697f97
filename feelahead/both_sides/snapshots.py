"""Pictures of an episode's cameras on demand, rendered in a process of their own as the robot side's are."""

import io
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
import numpy.typing as npt

from common.clock import MonotonicClock
from common.errors import FeelaheadError
from common.protocol.view_messages import ViewName
from robot_side.drivers.mujoco.scene import Scene
from robot_side.viewing.pictures import Cameras
from robot_side.viewing.settings import CamerasSettings

_LIMIT_S: Final = 60.0
_QUALITY: Final = 95


class Snapshots:
    """Cameras of a scene, as a context."""

    def __init__(self, scene: Scene, width: int, height: int) -> None:
        """Begin to render pictures of this size; ValueError for a size out of range."""
        self._notes: list[str] = []
        settings = CamerasSettings(width=width, height=height, quality=_QUALITY, codec="jpeg")
        self._cameras = Cameras(scene, settings, self._notes.append)
        self._clock = MonotonicClock()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._cameras.close()

    def take(self, view: ViewName) -> npt.NDArray[np.uint8]:
        """Return the picture of the scene as it is now, RGB (height, width, 3); FeelaheadError if there is none."""
        from PIL import Image  # noqa: PLC0415

        end_s = self._clock.now() + _LIMIT_S
        while (now_s := self._clock.now()) < end_s and self._cameras.works:
            for picture in self._cameras.update(now_s, now_s, [view]):
                image: Any = Image.open(io.BytesIO(picture.content), formats=["JPEG"])
                return np.asarray(image.convert("RGB"))
        raise FeelaheadError(self._notes[-1] if self._notes else f"no picture within {_LIMIT_S:g} s")
