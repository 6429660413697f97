"""Start of a command, before large imports: signals, output, and missing packages.

Only the standard library and small modules are imported here, so that a Ctrl-C right after the start is handled.
"""

import os
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType

from common.command.flag_value import value_of
from common.command.stop_signal import STOP_SIGNALS, LeavingAtOnce, say_output_failed
from common.extras import installing

Command = Callable[[Sequence[str]], int]

_OURS = ("common", "robot_side", "operator_side", "feelahead")
_BAD_INPUT = 2
PARENT_VARIABLE = "FEELAHEAD_PARENT"
"""Environment variable with the id of the process with which this one ends"""
_PR_SET_PDEATHSIG = 1


def launch(program: str, load: Callable[[], Command], extra: str | None = None, *, has_summary: bool = False) -> None:
    """Import the command with `load`, run it with this process's arguments, and exit.

    A stop signal ends the process with code 0 and without a traceback, even during imports. `has_summary`: the command
    has the flag --summary; until it opens a `StopSignal`, a stop signal writes the summary of a run that never began. A
    missing package becomes one line that names `extra`, the optional dependencies to install. `--version` needs no
    import.
    """
    LeavingAtOnce(_summary_path(sys.argv[1:]) if has_summary else None)
    _end_with_parent()
    _open_closed_streams()
    _write_in_any_locale()
    if sys.argv[1:] == ["--version"]:
        try:
            from importlib.metadata import version  # noqa: PLC0415  # loads the library for electronic mail

            sys.stdout.write(f"{program} {version('feelahead')}\n")
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
        sys.stderr.write(f"{program}: {missing} is not installed; to install it: {installing(extra)}\n")
        sys.exit(_BAD_INPUT)
    try:
        for number in () if has_summary else STOP_SIGNALS:
            signal.signal(number, _interrupt)
        run_command(program, command)
    except KeyboardInterrupt:
        # Just before or after run_command's own handling; otherwise the exit status would be SIGINT's.
        sys.exit(0)
    except ImportError as error:
        # A package that the command imports late makes an ImportError of the interrupt, as MuJoCo does.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        sys.exit(0)


def _end_with_parent() -> None:
    """Let Linux send SIGTERM when the parent that asked for it ends, even if that is killed."""
    if (parent := os.environ.pop(PARENT_VARIABLE, None)) is None:
        return
    import ctypes  # noqa: PLC0415  # not needed by a command that a person starts

    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if not Path(f"/proc/{parent}").exists():
        os._exit(0)


def _summary_path(arguments: Sequence[str]) -> str | None:
    """Return the path after --summary; None without one. A --config file is not read, as no parser is imported yet."""
    path = value_of("--summary", arguments)
    return None if path is None or path in ("", "None") or path.startswith("--") else path


def single_threaded_algebra() -> None:
    """Make NumPy's linear algebra use one thread, unless the environment says otherwise; call before importing NumPy.

    A tick's matrices are tiny: further threads would only wait for work and occupy processors.
    """
    for library in ("OPENBLAS", "MKL", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def _open_closed_streams() -> None:
    """Replace closed standard streams by the null device, as after `>&-`: else another file would take their number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115  # open until the end


def _write_in_any_locale() -> None:
    """Make both output streams write question marks for characters that their encoding lacks, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def _interrupt(number: int, frame: FrameType | None) -> None:
    del number, frame
    raise KeyboardInterrupt
