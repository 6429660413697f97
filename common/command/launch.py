"""Start of a command, before large imports: signals, output, and missing packages.

Only the standard library and small modules are imported here, so that a Ctrl-C right after the start meets a handler.
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

    A stop signal ends the process with code 0 and without a traceback, even during imports. With `has_summary` it
    writes the summary for --summary, until the command opens a `StopSignal`. A missing module becomes one line that
    names `extra`, the optional dependencies to install. `--version` needs no import.
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
        wanted = "." if extra is None else f".[{extra}]"
        sys.stderr.write(
            f"{program}: {missing} is not installed on this machine; valid: pip install '{wanted}' in the clone\n"
        )
        sys.exit(_BAD_INPUT)
    try:
        for number in () if has_summary else STOP_SIGNALS:
            signal.signal(number, _interrupt)
        run_command(program, command)
    except KeyboardInterrupt:
        # Just before or after run_command's own handling; otherwise the exit status would be SIGINT's.
        sys.exit(0)


def _summary_path(arguments: Sequence[str]) -> str | None:
    """Return the last value of --summary; parsers of it, or of a --config, are not imported yet."""
    path = value_of("--summary", arguments)
    return None if path is None or path in ("", "None") or path.startswith("--") else path


def single_threaded_algebra() -> None:
    """Default NumPy's linear algebra to one thread; call before NumPy is imported.

    A tick's matrices are tiny: further threads would only wait for work and take processors from others.
    """
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def _write_in_any_locale() -> None:
    """Replace characters that the terminal's encoding lacks by question marks, instead of a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def _interrupt(number: int, frame: FrameType | None) -> None:
    del number, frame
    raise KeyboardInterrupt
