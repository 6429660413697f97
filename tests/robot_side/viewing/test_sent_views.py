"""Views of which one is sent by a real camera, in virtual time, with a stand-in for the process that renders."""

import math
from collections.abc import Iterator
from typing import Literal, NamedTuple

import pytest

from common.protocol.view_messages import ViewName
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.drivers.remote.picture_message import Intrinsics
from robot_side.surroundings.mount import Mount
from robot_side.viewing.exchange import Ready, Sent, Undecodable
from robot_side.viewing.mount import MountSettings
from robot_side.viewing.settings import CamerasSettings
from tests.helpers.fake_companion import Desk
from tests.robot_side.viewing.view_table import TABLES, Table

BOTH: tuple[ViewName, ViewName] = ("overview", "first_person")


class Shot(NamedTuple):
    """Picture of a stand-in for a camera."""

    captured_s: float
    content: bytes = b"\xff\xd8\xff"
    width: int = 320
    height: int = 240
    format: Literal["jpeg", "rgb8"] = "jpeg"
    intrinsics: Intrinsics | None = None


class Shots:
    """Stand-in for the pictures that a camera process sends: those that the test puts here."""

    def __init__(self) -> None:
        self.fresh_ones: dict[ViewName, Shot] = {}
        self.shown: dict[ViewName, Shot] = {}
        self.sent: set[ViewName] = set()
        self.refused: list[tuple[ViewName, str]] = []
        self.watched: list[bool] = []
        self.period_s = self._next_s = 0.0

    def shoot(self, view: ViewName, captured_s: float, intrinsics: Intrinsics | None = None) -> None:
        self.fresh_ones[view] = self.shown[view] = Shot(captured_s, intrinsics=intrinsics)
        self.sent.add(view)

    def update(self, now_s: float, *, watched: bool) -> None:
        self.watched.append(watched)
        if self.period_s and now_s >= self._next_s:
            self._next_s = max(self._next_s, now_s - self.period_s) + self.period_s
            self.shoot("first_person", now_s - 0.03)

    def sends(self, view: ViewName) -> bool:
        return view in self.sent

    def fresh(self, view: ViewName) -> bool:
        return view in self.fresh_ones

    def take(self, view: ViewName) -> Shot | None:
        return self.fresh_ones.pop(view, None)

    def newest(self, view: ViewName) -> Shot | None:
        return self.shown.get(view)

    def refuse(self, view: ViewName, text: str, now_s: float) -> None:
        del now_s
        self.refused.append((view, text))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene()


@pytest.fixture
def shots() -> Shots:
    return Shots()


@pytest.fixture
def desk(scene: Scene, shots: Shots) -> Iterator[Desk]:
    made = Desk(scene, sent=shots)
    yield made
    made.close()


def test_a_sent_picture_is_ordered_once_with_its_own_time_and_the_other_view_is_rendered(
    desk: Desk, shots: Shots
) -> None:
    companion = desk.started()
    shots.shoot("first_person", 0.3)
    desk.cameras.update(0.5, 0.5, BOTH)
    rendered, sent = desk.orders()
    assert (rendered.view, rendered.sent, rendered.captured_s) == ("overview", None, 0.5)
    assert (sent.view, sent.sent, sent.captured_s) == ("first_person", Sent(320, 240, "jpeg", b"\xff\xd8\xff"), 0.3)
    for order in (rendered, sent):
        companion.picture(order)
    assert [picture.captured_s for picture in desk.cameras.update(0.6, 0.6, BOTH)] == [0.5, 0.3]
    assert [order.view for order in desk.orders()] == ["overview"]
    assert not desk.cameras.has_news("first_person")
    assert desk.cameras.has_news("overview")


def test_a_picture_that_cannot_be_decoded_is_refused_and_the_next_one_is_ordered(desk: Desk, shots: Shots) -> None:
    companion = desk.started()
    shots.shoot("first_person", 0.3)
    desk.cameras.update(0.5, 0.5, BOTH[1:])
    desk.orders()
    companion.answer(Undecodable("first_person", "no whole JPEG"))
    assert desk.cameras.update(0.6, 0.6, BOTH[1:]) == []
    assert shots.refused == [("first_person", "no whole JPEG")]
    shots.shoot("first_person", 0.6)
    desk.cameras.update(0.7, 0.7, BOTH[1:])
    assert [order.captured_s for order in desk.orders()] == [0.6]
    assert desk.notes == []


def test_where_nothing_can_be_rendered_sent_views_are_shown_all_the_same(scene: Scene, shots: Shots) -> None:
    desk = Desk(scene, sent=shots)
    desk.ready = Ready(h264=False, unrendered="no EGL; to mend it: install something")
    desk.started()
    desk.cameras.update(0.1, 0.1, ())
    assert desk.notes == ["cameras: only pictures that are sent are shown: no EGL; to mend it: install something"]
    assert not desk.cameras.has_news("overview")
    shots.shoot("overview", 0.1)
    assert desk.cameras.has_news("overview")
    desk.close()


def test_shapes_come_anew_with_the_viewpoint_of_a_mounted_camera_and_not_with_each_picture_of_one_that_zooms(
    shots: Shots,
) -> None:
    mounts = MountSettings(overview=Mount((0.5, 0.0, 1.5), (0.0, 1.0, 0.0, 0.0)))
    table = Table(sent=shots, cameras=CamerasSettings(mount=mounts))
    try:
        table.watch(overview=True, scene=True)
        table.run(1.0)
        assert [shapes.overview_eye for shapes in table.shapes()] == [None]
        for number in range(130):
            shots.shoot("overview", table.now_s, Intrinsics(200.0, 200.0 + number, 160.0, 120.0))
            table.run(0.03)
        first, second, third = table.shapes()[:3]
        assert first.version < second.version
        eye = second.overview_eye
        assert eye is not None
        assert eye.position_m == (0.5, 0.0, 1.5)
        assert eye.forward == pytest.approx((0.0, 0.0, -1.0))
        assert eye.up == pytest.approx((0.0, 1.0, 0.0))
        assert eye.fovy_deg == pytest.approx(math.degrees(2.0 * math.atan(120.0 / 200.0)))
        assert third.header.sent_s - second.header.sent_s > 2.9
        shots.shoot("first_person", table.now_s, Intrinsics(200.0, 200.0, 160.0, 120.0))
        table.run(3.5)
        assert table.shapes()[-1].eye is None  # Its mount is unknown.
    finally:
        TABLES.remove(table)
        table.desk.close()


@pytest.mark.parametrize(("period_s", "least", "most"), [(0.1, 27, 31), (0.005, 80, 91)])
def test_a_sent_view_is_shown_as_often_as_it_comes_but_no_more_often_than_a_rendered_one(
    shots: Shots, period_s: float, least: int, most: int
) -> None:
    shots.period_s = period_s
    table = Table(sent=shots)
    try:
        table.run(1.0)
        assert not any(shots.watched)
        assert len(shots.watched) >= 9
        table.watch(overview=True, first_person=True)
        table.run(3.0)
        views = [frame.view for frame in table.frames()]
        assert least <= views.count("first_person") <= most
        assert 80 <= views.count("overview") <= 91
        ages_s = [frame.header.sent_s - frame.captured_s for frame in table.frames() if frame.view == "first_person"]
        # 30 ms from the camera, then at most a period, and 4 ms in the stand-in.
        assert all(0.03 < age_s < 0.03 + period_s + 0.02 for age_s in ages_s)
        assert shots.watched[-1]
    finally:
        TABLES.remove(table)
        table.desk.close()
