"""The first moments of a command, before anything large is imported: signals, output, and what is not installed.

Only the standard library is imported here, and what imports nothing else, so that a Ctrl-C right after the start meets
a handler.
"""

import importlib.metadata
import os
import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType

from common.command.flag_value import value_of
from common.command.stop_signal import STOP_SIGNALS, LeavingAtOnce, say_output_failed

Command = Callable[[Sequence[str]], int]

_OURS = ("common", "robot_side", "operator_side", "feelahead")
_BAD_INPUT = 2


def launch(program: str, load: Callable[[], Command], extra: str | None = None, *, has_summary: bool = False) -> None:
    """Import the command with `load`, run it with this process's arguments, and exit.

    A stop signal ends the process with code 0 and without a traceback, whatever is being imported or built. With
    `has_summary` it leaves the summary that --summary asks for, until the command opens a `StopSignal`. A module that
    is not installed becomes one line that names `extra`, the optional dependencies to install. `--version` needs no
    import.
    """
    LeavingAtOnce(_summary_path(sys.argv[1:]) if has_summary else None)
    _write_in_any_locale()
    if sys.argv[1:] == ["--version"]:
        try:
            sys.stdout.write(f"{program} {importlib.metadata.version('feelahead')}\n")
            sys.stdout.flush()
        except OSError as error:
            sys.exit(say_output_failed(program, error))
        sys.exit(0)
    try:
        command = load()
        from common.command.command_line import run_command  # noqa: PLC0415  # large, hence not before the handlers
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing in _OURS:
            raise
        wanted = "feelahead" if extra is None else f"feelahead[{extra}]"
        sys.stderr.write(f"{program}: {missing} is not installed on this machine; valid: pip install '{wanted}'\n")
        sys.exit(_BAD_INPUT)
    try:
        for number in () if has_summary else STOP_SIGNALS:
            signal.signal(number, _interrupt)
        run_command(program, command)
    except KeyboardInterrupt:
        # Just before or after what run_command looks after itself; unhandled, it would end us with SIGINT's status.
        sys.exit(0)


def _summary_path(arguments: Sequence[str]) -> str | None:
    """Find the value of --summary, the last one; nothing that could parse it, or a --config, is imported yet."""
    path = value_of("--summary", arguments)
    return None if path is None or path in ("", "None") or path.startswith("--") else path


def single_threaded_algebra() -> None:
    """One thread for NumPy's linear algebra, unless somebody said otherwise; before NumPy is imported.

    A tick's matrices are tiny: the other threads would only wait for work, on processors that others could use.
    """
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def _write_in_any_locale() -> None:
    """A character that the terminal's encoding does not have becomes a question mark instead of a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def _interrupt(number: int, frame: FrameType | None) -> None:
    del number, frame
    raise KeyboardInterrupt
