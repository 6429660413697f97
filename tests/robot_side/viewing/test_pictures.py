"""The robot side's handling of the rendering companion, in virtual time, with a stand-in that the test controls."""

from collections.abc import Iterator
from typing import Literal

import pytest

from common.protocol.messages import Header
from common.protocol.view_messages import VideoStep, ViewName
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.viewing.exchange import Order, Ready, Refusal, Setup
from robot_side.viewing.pictures import IDLE_S, RETRY_S
from robot_side.viewing.settings import CamerasSettings
from tests.helpers.fake_companion import Desk

HEADER = Header(epoch=1, sequence=2, sent_s=3.0)
BOTH: tuple[ViewName, ViewName] = ("overview", "first_person")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene()


@pytest.fixture
def desk(scene: Scene) -> Iterator[Desk]:
    made = Desk(scene)
    yield made
    made.close()


def test_one_order_of_each_view_is_under_way_and_its_answer_carries_its_stamp(desk: Desk) -> None:
    companion = desk.started()
    desk.cameras.update(0.001, 0.5, BOTH)
    setup, *orders = companion.heard()
    assert isinstance(setup, Setup)
    assert [(order.view, order.captured_s) for order in orders if isinstance(order, Order)] == [
        ("overview", 0.5),
        ("first_person", 0.5),
    ]
    for turn in range(10):
        assert desk.cameras.update(0.002 + 0.001 * turn, 0.6, BOTH) == []
    assert companion.heard() == []
    companion.picture(orders[1])  # type: ignore[arg-type]
    [picture] = desk.cameras.update(0.02, 0.7, BOTH)
    assert (picture.view, picture.captured_s) == ("first_person", 0.5)
    assert [(order.view, order.captured_s) for order in desk.orders()] == [("first_person", 0.7)]


def test_an_order_holds_the_state_as_it_is(desk: Desk, scene: Scene) -> None:
    companion = desk.started()
    companion.heard()
    scene.data.qpos[0] += 0.125
    desk.cameras.update(0.001, 0.5, BOTH[:1])
    [order] = desk.orders()
    assert order.positions == scene.data.qpos.tobytes()


def test_a_companion_that_dies_is_said_and_started_again_but_not_at_once(desk: Desk) -> None:
    companion = desk.started()
    desk.cameras.update(0.001, 0.0, BOTH)
    for order in desk.orders():
        companion.picture(order)
    assert len(desk.cameras.update(0.01, 0.0, BOTH)) == 2
    companion.other.close()
    companion.running = False
    assert desk.cameras.update(0.02, 0.0, BOTH) == []
    [note] = desk.notes
    assert "ended unexpectedly" in note
    for turn in range(1, 100):
        desk.cameras.update(0.02 + turn * RETRY_S / 100.0, 0.0, BOTH)
    assert len(desk.companions) == 1
    desk.cameras.update(0.03 + RETRY_S, 0.0, BOTH)
    assert len(desk.companions) == 2
    desk.cameras.update(0.04 + RETRY_S, 0.0, BOTH)
    desk.companions[-1].picture(desk.orders()[0])
    assert len(desk.cameras.update(0.05 + RETRY_S, 0.0, BOTH)) == 1
    assert desk.notes == [note]
    assert desk.cameras.works


def test_where_it_cannot_work_that_is_said_once_and_nothing_is_tried_again(desk: Desk) -> None:
    companion = desk.started()
    companion.answer(Refusal("no EGL; to mend it: install something"))
    for turn in range(1000):
        desk.cameras.update(0.1 * turn, 0.0, BOTH)
    assert len(desk.companions) == 1
    assert desk.notes == [
        "cameras: there are no pictures, and the arm works without them: no EGL; to mend it: install something"
    ]
    assert not desk.cameras.works


def test_one_that_never_comes_to_a_picture_is_given_up(desk: Desk) -> None:
    for turn in range(2000):
        desk.cameras.update(0.01 * turn, 0.0, BOTH)
        if desk.companions:
            desk.companions[-1].other.close()
    assert len(desk.companions) == 2
    assert len(desk.notes) == 2
    assert "feelahead doctor" in desk.notes[-1]


def test_one_that_hangs_is_ended(desk: Desk) -> None:
    companion = desk.started()
    for turn in range(1, 4000):
        desk.cameras.update(0.01 * turn, 0.0, BOTH)
    assert companion.closed == [0.0]
    assert any("has not answered" in note for note in desk.notes)


def test_after_a_minute_without_anybody_it_ends_and_begins_anew_for_the_next(desk: Desk) -> None:
    companion = desk.started()
    desk.cameras.update(0.1, 0.0, BOTH)
    for order in desk.orders():
        companion.picture(order)
    desk.cameras.update(0.2, 0.0, ())
    desk.cameras.update(0.1 + IDLE_S, 0.0, ())
    assert companion.closed == []
    desk.cameras.update(0.2 + IDLE_S, 0.0, ())
    assert companion.channel.ended
    companion.running = False
    desk.cameras.update(0.3 + IDLE_S, 0.0, ())
    # It has ended by itself and is only closed.
    assert companion.closed == [0.0]
    desk.cameras.update(0.4 + IDLE_S, 0.0, BOTH)
    assert len(desk.companions) == 2
    assert desk.notes == []


def test_a_process_that_cannot_start_is_noted(desk: Desk) -> None:
    desk.fails_to_start = "no process can be started: Cannot allocate memory"
    desk.cameras.update(0.0, 0.0, BOTH)
    assert "Cannot allocate memory" in desk.notes[0]


@pytest.mark.parametrize(("codec", "lacks"), [("jpeg", (0, 0)), ("auto", None), ("auto", (0, 0))])
def test_steps_are_ordered_only_where_all_can_show_them(
    scene: Scene, codec: Literal["auto", "jpeg"], lacks: tuple[int, int] | None
) -> None:
    desk = Desk(scene, CamerasSettings(codec=codec))
    desk.started()
    desk.cameras.update(0.1, 0.0, BOTH, lacks)
    assert [order.h264 for order in desk.orders()] == 2 * [(codec, lacks) == ("auto", (0, 0))]
    desk.close()


def test_a_whole_picture_is_ordered_once_for_each_that_is_lacking_and_not_too_often(desk: Desk) -> None:
    companion = desk.started()
    began: list[int] = []

    def turn(now_s: float, number: int, lacks: int) -> None:
        desk.cameras.update(now_s, 0.0, BOTH[:1], (lacks, 0))
        [order] = desk.orders()
        began.extend([number] if order.whole else [])
        companion.picture(order, b"step", number, whole=number == 1 or order.whole)
        [picture] = desk.cameras.update(now_s, 0.0, ())
        assert isinstance(desk.cameras.message(picture, HEADER), VideoStep)

    for number in range(1, 100):
        # The tenth is lost; that is known two pictures later, and reported until the whole one is there, and longer.
        turn(0.1 * number, number, 10 if 12 <= number < 40 else 0)
    assert began == [12]
    for number in range(100, 130):
        turn(10.0 + 0.01 * number, number, number - 1)
    # A viewer that always lacks the newest is answered twice a second.
    assert began == [12, 100]


def test_where_steps_are_lost_again_and_again_pictures_need_no_other_for_a_while(desk: Desk) -> None:
    """Also if they are lost again when steps are tried: then they are tried less often."""
    companion = desk.started()
    number, steps = 0, []
    for turn in range(1500):
        now_s = 0.1 * turn
        desk.cameras.update(now_s, 0.0, BOTH[:1], (number, 0))  # whatever is sent is lost
        [order] = desk.orders()
        number += order.h264
        steps.append(order.h264)
        companion.picture(order, b"step" if order.h264 else b"whole", number if order.h264 else 0, whole=order.whole)
        desk.cameras.update(now_s, 0.0, ())
    changes = [0.1 * turn for turn in range(1, 1500) if steps[turn] != steps[turn - 1]]
    began_s, again_s, seldom_s, last_s, *_ = changes
    assert began_s < 3.0
    assert again_s - began_s == pytest.approx(30.0, abs=0.2)
    assert seldom_s - again_s < 3.0
    assert last_s - seldom_s == pytest.approx(60.0, abs=0.2)


def test_nothing_is_ordered_before_the_companion_is_ready(desk: Desk) -> None:
    companion = desk.started()
    companion.channel.receive()
    for turn in range(1, 100):
        desk.cameras.update(0.1 * turn, 0.1 * turn, BOTH)
    assert desk.orders() == []
    companion.answer(Ready(h264=True))
    desk.cameras.update(10.0, 10.0, BOTH)
    assert [order.captured_s for order in desk.orders()] == [10.0, 10.0]


@pytest.mark.parametrize("trouble", ["", "UnknownCodecError: libx264"])
def test_a_companion_without_h264_makes_jpeg_and_says_once_what_is_wrong_with_pyav(scene: Scene, trouble: str) -> None:
    desk = Desk(scene)
    desk.ready = Ready(h264=False, trouble=trouble)
    desk.started()
    for turn in range(10):
        desk.cameras.update(0.1 * turn, 0.0, BOTH, (0, 0))
    orders = desk.orders()
    assert [order.h264 for order in orders] == [False, False]
    assert [trouble in note for note in desk.notes] == ([True] if trouble else [])
    desk.close()
