import io
import os
import signal
import sys
import termios
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from rich.cells import cell_len
from rich.console import Console
from rich.screen import Screen as Whole

from common.command.live_line import UNKNOWN
from common.errors import ConfigurationError
from common.protocol.session import SessionState
from common.status.codes import LinkState, Sight
from common.status.statuses import RobotStatus
from operator_side.viewing.console.__main__ import said as said_on_page
from operator_side.viewing.facts import HandsFacts, OperatorFacts, SceneFacts
from operator_side.viewing.terminal.screen import SILENT_AFTER_S, Screen
from operator_side.viewing.terminal.status import TerminalStatus
from tests.operator_side.console_feed import facts
from tests.operator_side.viewing.terminal.on_terminal import LEFT, OnTerminal

PLAYER = """
import sys, time
from common.command.stop_signal import StopSignal
from operator_side.viewing.terminal.status import TerminalStatus
from tests.operator_side.console_feed import facts
with StopSignal() as stop, TerminalStatus("player") as status:
    print(status._companion.process_id, file=sys.stderr, flush=True)
    status.note("noted while it runs")
    for sent in range(10**9):
        if stop.is_set:
            break
        status.show_facts(facts(sent / 20))
        time.sleep(0.05)
status.note("the result")
"""


def drawn(shown: OperatorFacts | None, width: int = 80, height: int = 24, age_s: float = 0.0) -> list[str]:
    screen, console = Screen(), Console(file=io.StringIO(), width=width, height=height)
    for number in range(100):
        screen.notes.append(f"note {number} \x1b[2J")
        if shown is not None:
            screen.add(shown)
    lines = console.render_lines(Whole(screen.lines(age_s, width)), console.options.update(height=height))
    return ["".join(text for text, *_ in line) for line in lines]


def with_status(robot: RobotStatus | None = None, **status: Any) -> OperatorFacts:
    shown = facts(2.0)
    changed = msgspec.structs.replace(shown.status, **status)
    scene = SceneFacts(overlap_mm3=1e299, tick_us=80.0, tick_p99_us=140.0, overruns=0)
    return msgspec.structs.replace(shown, status=changed, robot=robot, scene=scene)


@pytest.mark.parametrize("size", [(60, 20), (80, 24), (120, 40), (200, 60), (10, 3), (1, 1)])
def test_every_size_is_filled_and_nothing_of_a_peer_controls_the_terminal(size: tuple[int, int]) -> None:
    robot = RobotStatus(target="目標 🤖\x1b[2J", nearest_mm=float("nan"))
    hostile = with_status(robot, link=LinkState.REFUSED, link_reason="\x07")
    for shown in (None, facts(2.0), hostile):
        lines = drawn(shown, *size)
        assert [cell_len(line) for line in lines] == [size[0]] * size[1]
        assert all(line.isprintable() for line in lines)


def test_everything_is_on_a_screen_of_the_usual_size() -> None:
    robot = RobotStatus(nearest="bottle", nearest_mm=34.0, target="mug", target_mm=120.0)
    text = "\n".join(drawn(with_status(robot)))
    for said in (
        *(">>> ARMED  advancing >>>", "link up", "lease armed", "hands person", "mean  52.0  p99  61.0  now"),
        *("asked: delay 50ms 10ms", "round trip 101 ms", "field age 1.0 ms", "R2 advances pulled  71 %, free to 40 %"),
        *("L2 retreats pulled   0 %, free to 100 %", ".  .  .  1  2  3  4  5  6", "meets   1 of 8   course leads to 6"),
        *("57 mm ahead", "20 30 40 50 60 70 80 90", "nearest bottle at 34 mm", "target mug at 120 mm"),
        *("holding nothing", "delay ", "meets  ", "overlap ", "tick p99 ", "140 of 140 µs", "note 99 ?[2J"),
    ):
        assert said in text


def test_nothing_near_has_no_name() -> None:
    text = "\n".join(drawn(with_status(RobotStatus())))
    assert f"nearest {UNKNOWN} mm" in text


@pytest.mark.parametrize(("reset_first", "lease"), [(True, "lease stopped  "), (False, "lease stopped, ready to arm")])
def test_a_stop_that_waits_for_its_reset_is_not_ready_to_arm(reset_first: bool, lease: str) -> None:
    shown = with_status(state="stopped", owner=SessionState.STOPPED_READY)
    page = HandsFacts(may_drive=True, driver="page", person=False, tuning_refused="", link_asked=None, counts=1.0)
    shown = msgspec.structs.replace(shown, page=msgspec.structs.replace(page, reset_first=reset_first))
    assert lease in "\n".join(drawn(shown, width=120))
    assert said_on_page(shown)["lease"] == lease.removeprefix("lease ").strip()


@pytest.mark.parametrize(
    ("status", "banner"),
    [
        ({"state": "disarmed", "owner": SessionState.READY, "person": None}, "--- DISARMED  ready to arm ---  "),
        ({"state": "stopped", "stopped_because": "emergency stop"}, "!!! STOPPED: emergency stop !!!!!"),
        ({"link": LinkState.LOST}, "!!! LINK LOST: nothing heard from the robot !!!!!"),
        ({"feel": Sight.WAITING}, "!!! RELEASE BOTH TRIGGERS !!!!!"),
        ({"link": LinkState.WAITING, "state": None}, "... waiting for the robot side ...  "),
    ],
)
def test_the_banner_says_what_keeps_the_arm_from_moving(status: dict[str, Any], banner: str) -> None:
    assert drawn(with_status(**status))[0].startswith(banner)
    assert drawn(with_status(**status), age_s=SILENT_AFTER_S + 0.01)[0].startswith("!!! NO NEWS for 0.5 s !!!!!")


@pytest.fixture
def player() -> Iterator[OnTerminal]:
    made = OnTerminal([sys.executable, "-P", "-c", PLAYER])
    yield made
    made.close()


@pytest.mark.processes
def test_the_screen_follows_the_terminals_size_and_is_put_back_on_ctrl_c(player: OnTerminal) -> None:
    player.read_until(lambda seen: b"ARMED" in seen and b"noted while it runs" in seen)
    typed = termios.tcgetattr(player.ours)
    assert not typed[3] & termios.ECHO
    assert typed[3] & termios.ISIG
    player.resize(60, 20)
    # A whole screen is sent at once, from the top left corner on, and does not scroll.
    player.read_until(lambda seen: b"\x1b[H" in seen and seen.split(b"\x1b[H")[-2].count(b"\n") == 19)
    assert player.end() == 0
    assert player.is_put_back()
    assert b"player: the result" in player.seen.partition(LEFT)[2]


@pytest.mark.processes
@pytest.mark.parametrize("whose", ["the run's", "its own"])
def test_a_kill_puts_the_terminal_back(player: OnTerminal, whose: str) -> None:
    assert player.process.stderr is not None
    companion = int(player.process.stderr.readline())
    player.read_until(lambda seen: b"ARMED" in seen)
    os.kill(player.process.pid if whose == "the run's" else companion, signal.SIGKILL)
    player.read_until(lambda _: player.is_put_back())
    if whose == "its own":
        assert player.process.poll() is None
        assert player.end() == 0


def test_what_is_no_terminal_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    with pytest.raises(ConfigurationError, match="no terminal"):
        TerminalStatus("player")
