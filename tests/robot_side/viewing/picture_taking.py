"""Pictures of a scene, rendered by the real companion process, and where points of the scene are in them."""

import select
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt
import pytest
import simplejpeg

from common.arrays import FloatArray
from common.companion.process import Companion
from common.protocol.view_messages import ViewName
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.viewpoints import Viewpoint, viewpoints
from robot_side.viewing.exchange import (
    Order,
    Picture,
    Ready,
    Refusal,
    Setup,
    decode_from_companion,
    encode,
)
from robot_side.viewing.pictures import saved_model
from robot_side.viewing.rendering import placed
from robot_side.viewing.starting import MODULE
from tests.helpers.machines.waiting import LIMIT_S

WIDTH, HEIGHT = 320, 240
Image = npt.NDArray[np.uint8]


class PictureTaker:
    """Client that orders pictures from a companion, one at a time, and waits for each."""

    def __init__(self, scene: Scene, companion: Companion, viewpoints_of: dict[ViewName, Viewpoint]) -> None:
        self.scene = scene
        self.viewpoints = viewpoints_of
        self.newest: Picture | None = None
        self._companion = companion
        companion.channel.send(encode(Setup(saved_model(scene), WIDTH, HEIGHT, viewpoints_of, h264=True)))
        self.ready = self._answer()

    def take(self, view: ViewName, captured_s: float = 1.5, *, halved: bool = False) -> Image:
        """Return a picture of the present scene in RGB (HEIGHT, WIDTH, 3); `halved`: of half the height and width."""
        image: Image = simplejpeg.decode_jpeg(self.picture(view, captured_s, halved=halved).content)
        return image

    def picture(self, view: ViewName, captured_s: float = 1.5, *, halved: bool = False, h264: bool = False) -> Picture:
        """Order one picture of the present scene; return the companion's answer, still encoded."""
        mujoco.mj_forward(self.scene.model, self.scene.data)
        data, channel = self.scene.data, self._companion.channel
        mocap = np.concatenate([data.mocap_pos, data.mocap_quat], axis=1)
        order = Order(view, captured_s, data.qpos.tobytes(), mocap.tobytes(), 95, halved, h264)
        channel.send(encode(order))
        picture = self._answer()
        assert isinstance(picture, Picture)
        self.newest = picture
        return picture

    def _answer(self) -> Ready | Picture:
        channel = self._companion.channel
        arrived: list[bytes] = []
        while not arrived and not channel.ended:
            select.select([channel], [channel] if channel.waiting else [], [], LIMIT_S)
            arrived = channel.receive()
        assert arrived, "the companion has ended"
        message: Ready | Picture | Refusal = decode_from_companion(arrived[0])
        if isinstance(message, Refusal):
            pytest.skip(f"nothing can be rendered here: {message.reason}")
        return message

    def pixel(self, view: ViewName, point_m: FloatArray) -> tuple[int, int]:
        """Return row and column at which a view shows the point (3,) of the world; AssertionError if it does not."""
        row, column, ahead_m = project(self.scene, self.viewpoints[view], point_m)
        assert ahead_m > 0.0
        assert 0 <= row < HEIGHT
        assert 0 <= column < WIDTH
        return int(row), int(column)


@contextmanager
def picture_taker(scene: Scene, viewpoints_of: dict[ViewName, Viewpoint] | None = None) -> Iterator[PictureTaker]:
    with Companion(MODULE) as companion:
        yield PictureTaker(scene, companion, viewpoints_of or viewpoints(scene))


def project(scene: Scene, viewpoint: Viewpoint, point_m: FloatArray) -> tuple[float, float, float]:
    """Return where a camera shows a point (3,) of the world: row, column, and distance ahead of the camera."""
    data, model = scene.data, scene.model
    if viewpoint.camera is None:
        place_m, forward, up = placed(viewpoint, data)
        fovy_deg = viewpoint.fovy_deg
    else:
        turned = data.cam_xmat[viewpoint.camera].reshape(3, 3)
        place_m, forward, up = data.cam_xpos[viewpoint.camera], -turned[:, 2], turned[:, 1]
        fovy_deg = float(model.cam_fovy[viewpoint.camera])
    ahead_m = float((point_m - place_m) @ forward)
    scale = 0.5 * HEIGHT / (ahead_m * np.tan(np.radians(0.5 * fovy_deg)))
    right = np.cross(forward, up)
    row, column = 0.5 * HEIGHT - scale * (point_m - place_m) @ up, 0.5 * WIDTH + scale * (point_m - place_m) @ right
    return float(row), float(column), ahead_m


def around(image: Image, pixel: tuple[int, int], by: int = 2) -> FloatArray:
    row, column = pixel
    mean: FloatArray = image[row - by : row + by + 1, column - by : column + by + 1].reshape(-1, 3).mean(axis=0)
    return mean
