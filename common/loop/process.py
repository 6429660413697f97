"""Process of a side, from settings to exit code.

At the start settings, files and keys are checked. Then everything is made and compiled; then ports are bound, and the
loop runs. Before `run` a stop signal ends the process at once, with code 0 and the summary of a run that never began.
A failed run has a summary, too; a refused start has none.
"""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any, Literal, Protocol, Self, TypeVar

from common.command.run_options import SideOptions
from common.command.status import Status
from common.command.stop_signal import LeavingAtOnce, StopSignal, ignore_broken_output
from common.files.output_file import write_json
from common.loop.loop import Loop, Side
from common.realtime.priority import make_realtime, raise_priority
from common.recording.side import Encoder, SideRecording, recording_to

Received = TypeVar("Received")


class Summarized(Side[Received], Protocol[Received]):
    """Side that returns figures of the run for the summary."""

    def close(self) -> None:
        """End companion processes and release devices; a second call does no harm."""

    def summary(self) -> Mapping[str, Any]:
        """Return the figures of the run; call it after `close`."""


class Process:
    """Parts around a side's loop: status, recording, and a stack of contexts that are closed at the end."""

    def __init__(
        self, settings: SideOptions, side: Literal["robot", "operator"], status: Status, encoder: Encoder, loop: Loop
    ) -> None:
        self._leaving = LeavingAtOnce(settings.summary)
        self._settings, self._side, self._encoder = settings, side, encoder
        self.status, self.loop, self.stack = status, loop, ExitStack()
        """stack: contexts that are closed at the end, the last one first"""
        self.recording: SideRecording | None = None
        """Recording of the run; None without one"""

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            opened.enter_context(self.status)
            self.recording = opened.enter_context(recording_to(self._settings.record, self._side, self._encoder))
            self.stack = opened.pop_all()
        return self

    def __exit__(self, *ended: Any) -> bool | None:
        return self.stack.__exit__(*ended)

    def note(self, text: str) -> None:
        """Show one line that the status output does not overwrite."""
        self.status.note(text)

    def run(self, open_side: Callable[[], Summarized[Received]]) -> int:
        """Make the side, run it, and write the summary; return the exit code. Raises the error that ended the run."""
        stop = self.stack.enter_context(StopSignal())
        self._leaving.summary = None
        if self.recording is not None:
            self.status.also = self.recording.note
        raise_priority()
        for text in make_realtime() if self._settings.realtime else ():
            self.note(text)
        side: Summarized[Received] | None = None
        failure: Exception | None = None
        try:
            # Last: no crowd at a port can use up the descriptors that are still needed.
            side = open_side()
            self.loop.run(side, stop, self._settings.duration)
        except BrokenPipeError:
            ignore_broken_output()  # no failure: the reader of our output has ended
        except Exception as error:
            failure = error
        summary = self.loop.summary(self._side)
        if side is not None:
            try:
                side.close()
            except Exception as error:
                failure = failure or error
            summary |= side.summary()
        if self.recording is not None:
            summary["recording"] = self.recording.close()
        summary["errors"] = [] if failure is None else [str(failure)]
        try:
            if self._settings.summary is not None:
                write_json("--summary", self._settings.summary, summary)
        finally:
            if failure is not None:
                raise failure
        return 0
