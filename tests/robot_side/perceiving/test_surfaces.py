"""Robot side's end of the process that maps depth pictures, with stand-ins for that process."""

import socket
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from common.companion.channel import Channel
from common.errors import ConfigurationError, FeelaheadError
from common.roles import ROLES, Role
from robot_side.arm.port import ArmState
from robot_side.depth.boxes import Boxes
from robot_side.depth.frames import SurfaceFrames
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import PIECES, SlotChanges, Slots
from robot_side.perceiving.exchange import (
    Forget,
    Joints,
    Note,
    Ready,
    Refusal,
    RoleOf,
    Setup,
    decode_to_companion,
    encode,
    surfaces,
)
from robot_side.perceiving.starting import setup_of
from robot_side.perceiving.surfaces import OLD_S, Surfaced
from robot_side.settings import RobotSettings
from robot_side.surroundings.perceived import UnknownSpace

SLOTS = 64
NEAR = np.zeros(3)
UNKNOWN = UnknownSpace(0.0, 0.5, 0.25, 0.0, 1.0, np.array([[[0.0, 0.0, 0.0], [0.04, 0.04, 0.08]]]))


class FakeCompanion:
    """Stand-in for the process: the test answers at `other`."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self.channel, self.other = Channel(ours), Channel(theirs)

    def close(self, limit_s: float = 2.0) -> bool:
        del limit_s
        self.channel.close()
        self.other.close()
        return True

    def heard(self) -> list[Any]:
        return [decode_to_companion(payload) for payload in self.other.receive()]

    def say(self, message: Any) -> None:
        assert self.other.send(encode(message))

    def show(self, changes: SlotChanges, taken_s: float) -> None:
        self.say(surfaces(changes, (taken_s, taken_s), {"holes": 3.0}, UNKNOWN))

    def show_four(self, count: int, taken_s: float) -> None:
        """Show a new map of this many boxes, by as many pictures as it needs."""
        slots = Slots(SLOTS)
        for _ in range(4):
            self.show(slots.update(_boxes(count), NEAR), taken_s)

    def works(self) -> bool:
        return True


class Desk:
    """A robot side's end, the companions that it started, and the lines that it told."""

    def __init__(self) -> None:
        self.companions: list[FakeCompanion] = []
        self.notes: list[str] = []
        settings = RobotSettings(perception="depth", depth_map=MapSettings(slots=SLOTS))
        self.end = Surfaced(
            setup_of(settings),
            lambda: SurfaceFrames(SLOTS, 0.003, 0.02),
            self.notes.append,
            self._start,  # type: ignore[arg-type]
        )

    def _start(self) -> FakeCompanion:
        self.companions.append(FakeCompanion())
        return self.companions[-1]

    def begin(self, now_s: float) -> FakeCompanion:
        """Let the first map be there at `now_s`."""
        self.look(now_s - 1.0)
        companion = self.companions[-1]
        companion.say(Ready(""))
        companion.show_four(3, now_s - 1.0)
        self.look(now_s - 1.0)
        self.look(now_s)
        return companion

    def look(self, now_s: float) -> Any:
        try:
            return self.end.perceive(now_s)
        except FeelaheadError:
            return None


@pytest.fixture
def desk() -> Iterator[Desk]:
    """Yield a desk whose companions are closed at the end."""
    desk = Desk()
    yield desk
    desk.end.close()
    for companion in desk.companions:
        companion.close()


def _boxes(count: int) -> Boxes:
    return Boxes(
        ids=np.arange(count),
        centers_m=np.arange(3.0 * count).reshape(count, 3),
        rotations=np.tile(np.eye(3), (count, 1, 1)),
        half_sizes_m=np.full((count, 3), 0.01),
        roles=np.full(count, -1),
        sds_m=np.full(count, 0.001),
    )


def _state(time_s: float) -> ArmState:
    return ArmState(time_s, np.arange(6.0), np.zeros(6), np.array([0.04, 0.04]), 0.08, gripper_holding=False)


def test_the_first_message_says_all_that_the_companion_needs(desk: Desk) -> None:
    desk.look(0.0)
    (setup,) = desk.companions[0].heard()
    assert isinstance(setup, Setup)
    assert setup.scene.name == "table"
    assert setup.port is None
    assert setup.mapped.slots == SLOTS


def test_nothing_is_perceived_until_the_first_map_has_grown_for_half_a_second(desk: Desk) -> None:
    with pytest.raises(FeelaheadError, match="no depth picture has been mapped yet"):
        desk.end.perceive(0.0)
    companion = desk.companions[0]
    slots = Slots(SLOTS)
    companion.show(slots.update(_boxes(3), NEAR), 0.0)
    assert desk.look(0.1) is None
    assert desk.look(0.9) is None
    for _ in range(3):
        companion.show(slots.update(_boxes(3), NEAR), 0.0)
    frame = desk.look(1.0)
    np.testing.assert_array_equal(frame.box_centers_m[PIECES : PIECES + 3], _boxes(3).centers_m)
    assert frame.unknown.shares == UNKNOWN.shares
    np.testing.assert_array_equal(frame.unknown.boxes_m, UNKNOWN.boxes_m)


def test_a_frame_stays_the_same_object_until_something_changes_and_its_errors_grow_with_age(desk: Desk) -> None:
    companion = desk.begin(10.0)
    first = desk.look(10.01)
    assert desk.look(10.02) is first
    later = desk.look(11.01)
    # 20 mm a second from the picture's time on, in steps of 0.5 mm.
    assert later.unseen_m - first.unseen_m == pytest.approx(0.02, abs=0.0006)
    companion.show(Slots(SLOTS).update(_boxes(2), NEAR), 11.0)
    assert desk.look(11.0).unseen_m == 0.0


def test_where_the_robot_is_goes_to_the_companion_with_what_it_holds(desk: Desk) -> None:
    companion = desk.begin(10.0)
    companion.heard()
    desk.end.tell(_state(10.0), 10.0, np.array([[0.0, 0.0, 0.1, 0.02]]))
    (joints,) = companion.heard()
    assert isinstance(joints, Joints)
    assert np.frombuffer(joints.arm).tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert np.frombuffer(joints.held).tolist() == [0.0, 0.0, 0.1, 0.02]


def test_known_models_go_to_the_companion_once_and_to_each_new_one(desk: Desk) -> None:
    companion = desk.begin(10.0)
    solids = np.arange(32.0).reshape(2, 16)
    desk.end.explain(solids)
    companion.heard()
    for step in range(2):
        desk.end.tell(_state(10.0 + step), 10.0 + step)
    assert [one.models for one in companion.heard()] == [solids.tobytes(), None]
    companion.other.close()
    desk.look(12.0)
    desk.look(14.1)
    desk.end.tell(_state(14.2), 14.2)
    assert desk.companions[1].heard()[-1].models == solids.tobytes()


def test_a_role_goes_to_the_companion(desk: Desk) -> None:
    companion = desk.begin(10.0)
    companion.heard()
    desk.end.set_role("surface 2", Role.TARGET)
    assert companion.heard() == [RoleOf("surface 2", Role.TARGET)]


def test_a_companion_that_dies_is_started_again_and_what_was_seen_stays_until_the_new_map_has_grown(desk: Desk) -> None:
    desk.begin(10.0).other.close()
    assert desk.look(10.1) is not None
    assert any("started again" in text for text in desk.notes)
    desk.look(12.2)
    assert len(desk.companions) == 2
    desk.companions[1].show_four(1, 12.3)
    still = desk.look(14.0)
    assert np.count_nonzero(still.box_centers_m[:, 2] > -100.0) == 3
    new = desk.look(16.1)
    assert "what no camera sees now is forgotten" in desk.notes[-1]
    assert np.count_nonzero(new.box_centers_m[:, 2] > -100.0) == 1


def test_pictures_that_stop_are_told_once_and_once_that_they_are_back(desk: Desk) -> None:
    companion = desk.begin(10.0)
    companion.show(Slots(SLOTS).update(_boxes(3), NEAR), 10.0)
    for step in range(5):
        desk.look(10.1 + 0.01 * step)
    old = [text for text in desk.notes if "old" in text]
    for step in range(5):
        desk.look(10.1 + OLD_S + 0.01 * step)
    assert len([text for text in desk.notes if "old" in text]) == len(old) + 1
    companion.show(Slots(SLOTS).update(_boxes(3), NEAR), 10.7)
    desk.look(10.7)
    assert desk.notes[-1] == "depth: pictures arrive again"


def test_a_refusal_before_the_first_map_ends_the_start(desk: Desk) -> None:
    desk.look(0.0)
    desk.companions[0].say(Refusal("no EGL"))
    with pytest.raises(ConfigurationError, match="depth: no EGL"):
        desk.end.perceive(0.1)


def test_a_refusal_once_there_is_a_map_is_a_line(desk: Desk) -> None:
    desk.begin(10.0).say(Refusal("no EGL"))
    assert desk.look(10.1) is not None
    assert "depth: no EGL" in desk.notes


def test_a_companion_that_does_not_compute_is_replaced(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    companion = desk.begin(10.0)
    monkeypatch.setattr(companion, "works", lambda: False)
    desk.look(28.0)
    assert len(desk.companions) == 1
    desk.look(30.0)
    desk.look(33.0)
    assert len(desk.companions) == 2


def test_without_pictures_a_companion_that_is_ready_is_left_alone(desk: Desk) -> None:
    desk.look(0.0)
    desk.companions[0].say(Ready("tcp://127.0.0.1:5604"))
    for second in range(1, 200, 5):
        desk.look(float(second))
    assert len(desk.companions) == 1


def test_what_was_seen_is_forgotten_when_the_objects_are_put_back(desk: Desk) -> None:
    companion = desk.begin(10.0)
    companion.heard()
    desk.end.put_back()
    assert companion.heard() == [Forget()]


def test_the_companions_lines_are_told(desk: Desk) -> None:
    desk.begin(10.0).say(Note("depth pictures: one was refused"))
    desk.look(10.1)
    assert desk.notes[-1] == "depth pictures: one was refused"


def test_the_summary_has_ages_and_the_newest_pictures_figures(desk: Desk) -> None:
    companion = desk.begin(10.0)
    companion.show(Slots(SLOTS).update(_boxes(3), NEAR), 9.9)
    desk.look(10.0)
    summary = desk.end.summary()
    assert summary["frames"] == 5
    assert summary["newest"] == {"holes": 3.0, "crowded_out": 0.0}
    assert summary["age_ms"]["p99"] == pytest.approx(96.0)


def test_roles_are_those_of_the_slots(desk: Desk) -> None:
    companion = desk.begin(10.0)
    slots, boxes = Slots(SLOTS), _boxes(3)
    object.__setattr__(boxes, "roles", np.array([-1, ROLES.index(Role.SUPPORT), -1]))
    companion.show(slots.update(boxes, NEAR), 10.0)
    assert desk.look(10.0).roles[1:4] == (Role.OBSTACLE, Role.SUPPORT, Role.OBSTACLE)
