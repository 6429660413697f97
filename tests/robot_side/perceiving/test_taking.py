"""Pictures that processes send, mapped from where the robot was when they were taken."""

from collections.abc import Callable

import numpy as np
import pytest

from robot_side.depth.camera_settings import LinkMount
from robot_side.depth.perception import DepthPerception
from robot_side.depth.picture import CameraPose, DepthErrors, DepthPicture, OwnBody, Pinhole
from robot_side.depth.settings import MapSettings
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot, RobotParts
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.drivers.remote.depth import TakenDepth
from robot_side.drivers.remote.depth_message import SentMount
from robot_side.perceiving.exchange import Joints
from robot_side.perceiving.taking import SentPictures

ERRORS = DepthErrors(0.004)
AHEAD = LinkMount((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), "world")
SMALL = MapSettings(lower_m=(-0.5, -0.5, 0.0), upper_m=(0.5, 0.5, 1.0), slots=64)


class FakeRemote:
    """Stand-in for the port: pictures that the test puts there."""

    def __init__(self) -> None:
        self.waiting: dict[str, TakenDepth] = {}
        self.refused: list[tuple[str, str]] = []

    def update(self, now_s: float) -> tuple[str, ...]:
        del now_s
        return tuple(self.waiting)

    def take(self, camera: str) -> TakenDepth | None:
        return self.waiting.pop(camera, None)

    def refuse(self, why: str, camera: str, text: str, now_s: float) -> None:
        del now_s, why
        self.refused.append((camera, text))


class Noting(DepthPerception):
    """Stands where the map is, and notes what is mapped."""

    def __init__(self) -> None:
        super().__init__(SMALL)
        self.seen: list[tuple[float, CameraPose, OwnBody, int]] = []

    def see(self, picture: DepthPicture, pose: CameraPose, body: OwnBody, errors: DepthErrors, camera: int) -> None:
        del errors
        self.seen.append((picture.taken_s, pose, body, camera))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene()


def _pictures(scene: Scene, mounts: dict[str, LinkMount]) -> tuple[SentPictures, FakeRemote, Noting]:
    remote, noting = FakeRemote(), Noting()
    robot = PosedRobot(scene.model, RobotParts.of(scene.robot), scene.data.qpos)
    perceive: Callable[[], DepthPerception] = lambda: noting  # noqa: E731
    return SentPictures(remote, robot, mounts, perceive, ERRORS), remote, noting  # type: ignore[arg-type]


def _taken(taken_s: float, latest_s: float | None = None, mount: SentMount | None = None) -> TakenDepth:
    depth_m = np.full((24, 32), 0.5, dtype=np.float32)
    picture = DepthPicture(taken_s, depth_m, Pinhole(30.0, 30.0, 16.0, 12.0))
    return TakenDepth(picture, taken_s if latest_s is None else latest_s, mount)


def _joints(scene: Scene, time_s: float, first_rad: float, held: bytes = b"") -> Joints:
    robot, start = scene.robot, scene.data.qpos
    arm = start[robot.arm_positions].copy()
    arm[0] = first_rad
    return Joints(time_s, arm.tobytes(), start[robot.finger_positions].tobytes(), held)


def test_a_camera_on_a_link_is_where_the_link_was_at_the_middle_of_the_pictures_time(scene: Scene) -> None:
    link = scene.model.body(int(scene.model.site_bodyid[scene.robot.site])).name
    mount = LinkMount((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), link)
    pictures, remote, noting = _pictures(scene, {"wrist": mount})
    for step in range(5):
        pictures.hear(_joints(scene, 10.0 + 0.1 * step, 0.1 * step))
    remote.waiting["wrist"] = _taken(10.10, 10.20)
    news = pictures.step(10.45)
    assert news is not None
    assert news.taken_s == (10.10, 10.20)
    robot = PosedRobot(scene.model, RobotParts.of(scene.robot), scene.data.qpos)
    arm = scene.data.qpos[scene.robot.arm_positions].copy()
    arm[0] = 0.15
    robot.pose(arm, scene.data.qpos[scene.robot.finger_positions])
    np.testing.assert_allclose(noting.seen[0][1].position_m, robot.camera(link, mount).position_m, atol=1e-9)


def test_the_settings_mount_comes_before_the_pictures_own(scene: Scene) -> None:
    sent = SentMount("world", (0.0, 0.0, 9.0), (1.0, 0.0, 0.0, 0.0))
    for mounts, height_m in (({}, 9.0), ({"above": AHEAD}, 0.0)):
        pictures, remote, noting = _pictures(scene, mounts)
        pictures.hear(_joints(scene, 10.0, 0.0))
        remote.waiting["above"] = _taken(10.0, mount=sent)
        assert pictures.step(10.1) is not None
        assert noting.seen[0][1].position_m[2] == height_m


def test_a_camera_without_a_mount_is_refused_by_name(scene: Scene) -> None:
    pictures, remote, noting = _pictures(scene, {})
    pictures.hear(_joints(scene, 10.0, 0.0))
    remote.waiting["side"] = _taken(10.0)
    assert pictures.step(10.1) is None
    assert noting.seen == []
    ((camera, text),) = remote.refused
    assert camera == "side"
    assert "[depth.mounts.side]" in text


def test_a_mount_on_a_link_that_the_model_lacks_is_refused(scene: Scene) -> None:
    pictures, remote, noting = _pictures(scene, {})
    pictures.hear(_joints(scene, 10.0, 0.0))
    remote.waiting["side"] = _taken(10.0, mount=SentMount("tail", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
    assert pictures.step(10.1) is None
    assert "link = 'tail'; valid:" in remote.refused[0][1]
    assert noting.seen == []


@pytest.mark.parametrize("age_s", [1.1, 20.0])
def test_a_picture_that_is_too_old_is_left_out(scene: Scene, age_s: float) -> None:
    pictures, remote, noting = _pictures(scene, {"side": AHEAD})
    pictures.hear(_joints(scene, 30.0, 0.0))
    remote.waiting["side"] = _taken(30.0 - age_s)
    assert pictures.step(30.0) is None
    assert noting.seen == []


def test_two_cameras_have_numbers_of_their_own_and_what_is_held_is_the_robots_own(scene: Scene) -> None:
    pictures, remote, noting = _pictures(scene, {"left": AHEAD, "right": AHEAD})
    held = np.array([[0.0, 0.0, 0.05, 0.02]])
    pictures.hear(_joints(scene, 10.0, 0.0, held.tobytes()))
    remote.waiting |= {"left": _taken(10.0), "right": _taken(10.0)}
    assert pictures.step(10.1) is not None
    assert [camera for *_, camera in noting.seen] == [0, 1]
    assert noting.seen[0][2].sizes_m[-1].tolist() == [0.02, 0.02, 0.02]
