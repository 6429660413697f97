import os
import pty
import re
import signal
import sys
import termios
import time
from collections.abc import Iterator

import pytest

from common.errors import ConfigurationError
from operator_side.terminal_view.status import TerminalStatus
from tests.operator_side.terminal_view.on_terminal import LEFT, LIMIT_S, OnTerminal

pytestmark = pytest.mark.processes

PLAYER = """
import sys, time
from common.clock import MonotonicClock
from common.command.stop_signal import StopSignal
from common.errors import ConfigurationError
from operator_side.terminal_view.status import TerminalStatus
from tests.operator_side.terminal_view.made_up_facts import facts_in_motion

clock, sent = MonotonicClock(), 0
with StopSignal() as stop, TerminalStatus("player") as status:
    print(status._companion.process_id, file=sys.stderr, flush=True)
    status.note("noted while it runs")
    while not stop.is_set:
        status.show_facts(facts_in_motion(clock.now()))
        sent += 1
        time.sleep(0.001 if "--fast" in sys.argv else 0.05)
        if sent == 3000:
            print("sent", file=sys.stderr, flush=True)
status.note("the result")
"""


class Player(OnTerminal):
    """A program that shows made-up facts."""

    def __init__(self, *arguments: str) -> None:
        super().__init__([sys.executable, "-P", "-c", PLAYER, *arguments])
        self.companion = int(self.said())


@pytest.fixture
def player() -> Iterator[Player]:
    made = Player()
    yield made
    made.close()


def test_the_screen_is_drawn_and_everything_put_back_on_ctrl_c(player: Player) -> None:
    player.read_until(lambda seen: b"ARMED" in seen and b"noted while it runs" in seen)
    typed = termios.tcgetattr(player.ours)
    assert not typed[3] & termios.ECHO
    assert typed[3] & termios.ISIG
    assert player.end(b"the result") == 0
    assert player.is_put_back()
    # A result stays on the first screen.
    assert b"player: the result" in player.seen.partition(LEFT)[2]


def test_a_kill_of_the_program_puts_the_terminal_back(player: Player) -> None:
    player.read_until(lambda seen: b"ARMED" in seen)
    player.process.kill()
    player.read_until(lambda seen: LEFT in seen)
    assert player.process.wait(LIMIT_S) == -signal.SIGKILL
    end_s = time.monotonic() + LIMIT_S
    while not player.is_put_back() and time.monotonic() < end_s:
        time.sleep(0.01)
    assert player.is_put_back()


def test_a_kill_of_what_draws_puts_the_terminal_back(player: Player) -> None:
    player.read_until(lambda seen: b"ARMED" in seen)
    os.kill(player.companion, signal.SIGKILL)
    player.read_until(lambda seen: LEFT in seen)
    assert player.is_put_back()
    assert player.process.poll() is None
    assert player.end(b"the result") == 0


def test_a_new_size_is_drawn_in_and_never_scrolls(player: Player) -> None:
    player.read_until(lambda seen: b"ARMED" in seen)
    player.resize(60, 20)
    player.seen = b""
    player.read_until(lambda seen: b"\x1b[20;1H" in seen)
    rows = {int(row) for row in re.findall(rb"\x1b\[(\d+);1H", player.seen.partition(b"\x1b[2J")[2])}
    assert rows == set(range(1, 21))
    assert b"\n" not in player.seen
    player.end(b"the result")
    assert player.is_put_back()


def test_a_terminal_that_stalls_holds_nobody_up() -> None:
    player = Player("--fast")
    player.read_until(lambda seen: b"ARMED" in seen)
    termios.tcflow(player.theirs, termios.TCOOFF)
    assert player.said() == "sent\n"
    termios.tcflow(player.theirs, termios.TCOON)
    assert player.end(b"the result") == 0
    assert player.is_put_back()
    player.close()


def test_what_is_no_terminal_is_refused(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with capfd.disabled():
        ours, theirs = pty.openpty()
        monkeypatch.setenv("TERM", "dumb")
        with os.fdopen(theirs, "w") as terminal:
            monkeypatch.setattr(sys, "stdout", terminal)
            with pytest.raises(ConfigurationError, match="TERM"):
                TerminalStatus("player")
        os.close(ours)
