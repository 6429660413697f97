"""Play a recording on the console's page, or on the full terminal."""

import select
import threading
from collections.abc import Callable, Iterator
from typing import Any, Final

import msgspec

from common.clock import MonotonicClock
from common.command.status import Status
from common.command.stop_signal import StopSignal
from common.recording.reading import Recording
from common.status.statuses import RobotStatus
from feelahead.commands.open_browser import show_address
from feelahead.recordings.playback import FACTS, ROBOT, VIEW, Playback, Seen
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts import OperatorFacts
from operator_side.viewing.terminal.status import TerminalStatus
from operator_side.viewing.viewing import SceneFigures

_PROGRAM: Final = "feelahead replay"
_STEP_S: Final = 0.01
_LONGEST_S: Final = 0.25
"""Longest step of the playback, in seconds: after the machine was suspended, nothing is skipped."""
_STATE_PERIOD_S: Final = 0.1


def play_on_page(recording: Recording, speed: float, port: int) -> int:
    """Play on the console from when a page is open until Ctrl-C; return 1 if the console's process ended, else 0."""
    title = f"{recording.path.name}, replayed"
    with StopSignal() as stop, Status("line", _PROGRAM) as status, Console(title, port=port, live=False) as console:
        facts, clock = msgspec.json.Decoder(OperatorFacts), MonotonicClock()
        playback = Playback(recording, speed)
        opened, came, since_s = False, 0, 0.0
        said: dict[str, Any] = {}

        def look(seconds: float) -> bool:
            select.select([console], [], [], seconds)
            console.receive(clock.now())
            for text in console.take_notes():
                status.note(text)
            return not (stop.is_set or console.gone)

        def send(one: Seen) -> None:
            if one.kind == FACTS:
                console.facts(facts.decode(one.content))
            elif one.kind == VIEW:
                console.view(one.content, video=False)

        while console.address is None and look(_STEP_S):
            pass
        if console.address is not None:
            show_address(console.address, status)
            status.note("it plays as soon as the page is open; Ctrl-C ends it")
        for passed_s in _passing(look):
            if console.pages and not opened:
                opened, playback.paused = True, False
            if console.came != came:
                came = console.came
                playback.show_again()
            while console.words:
                playback.wish((console.words.popleft()[1] or {}).get("play"))
            for one in playback.advance(passed_s):
                send(one)
            since_s += passed_s
            if since_s >= _STATE_PERIOD_S and (state := playback.state()) != said:
                since_s, said = 0.0, state
                console.played(state)
        return 1 if console.gone else 0


def play_in_terminal(recording: Recording, speed: float) -> int:
    """Play to the end, or until Ctrl-C. Raises ConfigurationError unless standard output is a terminal."""
    decoder, pause = msgspec.json.Decoder(OperatorFacts), threading.Event()
    with TerminalStatus(_PROGRAM) as status, StopSignal() as stop:
        robot: RobotStatus | None = None
        figures = SceneFigures()

        def send(one: Seen) -> None:
            nonlocal robot
            if one.kind == ROBOT:
                robot = msgspec.json.decode(one.content, type=RobotStatus)
            elif one.kind == VIEW:
                figures.receive(one.content)
            else:
                facts = decoder.decode(one.content)
                status.show_facts(msgspec.structs.replace(facts, robot=robot, scene=figures.newest))

        playback = Playback(recording, speed)
        playback.paused = False

        def goes_on(seconds: float) -> bool:
            pause.wait(seconds)
            return not (stop.is_set or playback.over)

        for passed_s in _passing(goes_on):
            for one in playback.advance(passed_s):
                send(one)
    return 0


def _passing(goes_on: Callable[[float], bool]) -> Iterator[float]:
    """Yield the seconds that each step took, at most `_LONGEST_S`.

    `goes_on(seconds)` waits for the given time; the steps end when it returns False.
    """
    clock = MonotonicClock()
    before_s = clock.now()
    while goes_on(_STEP_S):
        now_s = clock.now()
        yield min(now_s - before_s, _LONGEST_S)
        before_s = now_s
