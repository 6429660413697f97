import msgspec
import pytest

from common.episode import EpisodeMark
from common.protocol.codec import decode, encode
from common.protocol.messages import LeaseNotice, Mark
from common.protocol.session import SessionState
from operator_side.controller.state import Button
from operator_side.core import OperatorSide
from operator_side.core_settings import CoreSettings
from operator_side.events import Input, Listener
from tests.operator_side.operator_bench import Bench

PERIOD_S = 0.02


class Heard(Listener):
    def __init__(self) -> None:
        self.marks: list[object] = []

    def on_input(self, what: Input, content: object, now_s: float | None) -> None:
        assert now_s is not None
        self.marks += [content] if what == "episode" else []


class Desk(Bench):
    """Operator side that hears notices ten times a second while time passes."""

    def __init__(self, *, fixed_task: bool = False) -> None:
        super().__init__()
        self.heard = Heard()
        self.side = OperatorSide(2, "clock", CoreSettings(fixed_task=fixed_task), [self.heard])
        self.side.receive(encode(self.robot.hello(self.now_s)), self.now_s)
        self.session, self.answer = SessionState.DISARMED, (0, "")
        self.tell()

    def tell(self) -> None:
        notice = LeaseNotice(self.robot.stamp(self.now_s), session=self.session, why="", token=7, waiting=0)
        self.side.receive(
            encode(msgspec.structs.replace(notice, marked=self.answer[0], mark_refused=self.answer[1])), self.now_s
        )

    def marks(self, for_s: float, *buttons: Button) -> list[tuple[int, EpisodeMark]]:
        sent = []
        for _ in range(round(for_s / PERIOD_S)):
            self.now_s += PERIOD_S
            self.tell()
            self.hands(*buttons)
            sent += [decode(payload) for payload in self.payloads()]
        return [(one.number, one.kind) for one in sent if isinstance(one, Mark)]


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_a_press_counts_once_and_is_repeated_until_it_was_answered(desk: Desk) -> None:
    assert desk.marks(0.38, Button.UP) == [(1, "start")] * 4
    desk.answer = 1, ""
    assert desk.marks(0.3, Button.UP) == []
    assert desk.marks(0.1) == []
    assert desk.marks(0.04, Button.RIGHT) == [(2, "success")]
    desk.answer = 2, ""
    desk.marks(0.1)
    assert desk.heard.marks == ["start", "success"]
    assert desk.side.summary()["episodes"] == {"start": 1, "success": 1}
    assert desk.side.marker.take_notes() == ["episode: start", "episode: success"]


def test_results_need_a_start_and_marks_the_lease(desk: Desk) -> None:
    for button in (Button.RIGHT, Button.LEFT, Button.DOWN):
        assert desk.marks(0.1, button) == []
    assert len(desk.side.marker.take_notes()) == 3
    desk.session = SessionState.OBSERVING
    assert desk.marks(0.1, Button.UP) == []
    assert desk.side.marker.take_notes() == ["start refused: only the owner may"]
    assert desk.heard.marks == []


def test_a_reset_counts_once_the_robot_side_says_it_is_done(desk: Desk) -> None:
    desk.marks(0.1, Button.UP)
    desk.answer = 1, ""
    assert (2, "reset") in desk.marks(0.3, Button.R3)
    desk.answer = 2, "the arm is armed"
    desk.marks(0.1)
    assert desk.heard.marks == ["start"]
    assert desk.side.marker.take_notes()[-1] == "reset refused: the arm is armed"
    assert desk.marks(0.3, Button.R3)[0] == (3, "reset")
    desk.answer = 3, ""
    desk.marks(0.1)
    assert desk.heard.marks == ["start", "reset"]
    # It ended the episode.
    assert desk.marks(0.1, Button.RIGHT) == []
    assert "no episode has begun" in desk.side.marker.take_notes()[-1]


def test_a_mark_without_an_answer_is_given_up(desk: Desk) -> None:
    assert len(desk.marks(5.0, Button.R3)) == pytest.approx(20, abs=1)
    assert desk.side.marker.take_notes() == ["reset refused: the robot side did not answer"]


def test_with_a_fixed_task_no_mark_leaves() -> None:
    desk = Desk(fixed_task=True)
    assert desk.marks(0.3, Button.R3) + desk.marks(0.1, Button.UP) == []
    desk.side.marker.mark("reset", desk.now_s)
    assert desk.marks(0.3) == []
    notes = ["reset refused: the task is fixed", "start refused: the task is fixed", "reset refused: the task is fixed"]
    assert desk.side.marker.take_notes() == notes
