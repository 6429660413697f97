"""A recording shown once more: on the console's page, or on the whole terminal."""

import select
import threading
from collections.abc import Callable

import msgspec

from common.command.live_view import Value
from common.command.status import Status
from common.command.stop_signal import StopSignal
from common.recording.reading import Recording
from feelahead.both_sides.summary import both_statuses
from feelahead.commands.open_browser import show_address
from feelahead.recordings.showing import FACTS, ROBOT, VIEW, show
from operator_side.console.console import Console
from operator_side.facts import OperatorFacts
from operator_side.scene_figures import SceneFigures
from operator_side.terminal_view.status import TerminalStatus

_PROGRAM = "feelahead replay"
_GLANCE_S = 0.05
"""How often we look whether to stop."""


def play_on_page(recording: Recording, speed: float, port: int) -> int:
    """From the moment when a page is open to the end, and then its last picture until Ctrl-C; 1 without a console."""
    title = f"{recording.path.name}, replayed"
    with StopSignal() as stop, Status("line", _PROGRAM) as status, Console(title, port=port, live=False) as console:
        facts = msgspec.json.Decoder(OperatorFacts)

        def look(seconds: float) -> bool:
            while True:
                ready, _, _ = select.select([console], [], [], min(seconds, _GLANCE_S))
                if ready:
                    console.receive()
                for text in console.take_notes():
                    status.note(text)
                seconds -= 0.0 if ready else _GLANCE_S
                if stop.is_set or console.gone or seconds <= 0.0:
                    return not (stop.is_set or console.gone)

        def send(kind: bytes, content: bytes) -> None:
            if kind == FACTS:
                console.facts(facts.decode(content))
            elif kind == VIEW:
                console.view(content, video=False)

        while console.address is None and look(_GLANCE_S):
            pass
        if console.address is not None:
            show_address(console.address, status)
            status.note("it plays as soon as the page is open; Ctrl-C ends it")
        while console.pages == 0 and look(_GLANCE_S):
            pass
        if console.pages:
            show(recording, send, look, speed)
            status.note("that was all; Ctrl-C ends it")
        while look(_GLANCE_S):
            pass
        return 1 if console.gone else 0


def play_in_terminal(recording: Recording, speed: float) -> int:
    """To the end, or until Ctrl-C. ConfigurationError unless standard output is a terminal."""
    decoder, pause = msgspec.json.Decoder(OperatorFacts), threading.Event()
    with TerminalStatus(_PROGRAM) as status, StopSignal() as stop:
        robot: dict[str, Value] = {}
        figures = SceneFigures()

        def send(kind: bytes, content: bytes) -> None:
            if kind == ROBOT:
                robot.update(msgspec.json.decode(content))
            elif kind == VIEW:
                figures.take(content)
            else:
                facts = decoder.decode(content)
                known = both_statuses(robot, facts.status) | figures.figures()
                status.show_facts(msgspec.structs.replace(facts, status=known))

        show(recording, send, _patient(pause, stop), speed)
    return 0


def _patient(pause: threading.Event, stop: StopSignal) -> Callable[[float], bool]:
    def wait(seconds: float) -> bool:
        while seconds > 0.0 and not stop.is_set:
            pause.wait(min(seconds, _GLANCE_S))
            seconds -= _GLANCE_S
        return not stop.is_set

    return wait
