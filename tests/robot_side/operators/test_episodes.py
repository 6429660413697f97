"""Marks of episodes at the robot side: the owner's alone count, each once; and the scene put back to its start."""

from common.protocol.codec import encode
from common.protocol.messages import EpisodeMark, Mark
from robot_side.events import Listener
from tests.robot_side.session_bench import Bench, Operator


class Heard(Listener):
    """Listener that keeps the accepted marks."""

    def __init__(self) -> None:
        self.marks: list[EpisodeMark] = []

    def on_episode(self, mark: EpisodeMark, now_s: float) -> None:
        del now_s
        self.marks.append(mark)


def mark(bench: Bench, operator: Operator, number: int, kind: EpisodeMark) -> tuple[int, str]:
    """Send a mark; return the answer."""
    bench.robot.receive(operator.peer, encode(Mark(operator.link.stamp(bench.now_s), number, kind)), bench.now_s)
    bench.tick()
    assert operator.notice is not None
    return operator.notice.marked, operator.notice.mark_refused


def test_the_owners_marks_count_once_each_and_are_answered_at_once() -> None:
    heard = Heard()
    bench = Bench(listeners=[heard])
    owner, observer = bench.join(2), bench.join(3, b"observer")
    assert mark(bench, owner, 1, "start") == (1, "")
    assert mark(bench, owner, 1, "start") == (1, "")
    assert mark(bench, observer, 4, "failure") == (4, "only the owner may")
    assert mark(bench, observer, 5, "reset") == (5, "only the owner may")
    assert mark(bench, owner, 2, "success") == (2, "")
    assert heard.marks == ["start", "success"]
    assert bench.robot.summary()["episodes"] == {"start": 1, "success": 1}
