"""Trial of a model that somebody brought: what MuJoCo's compiler takes for a small file, nothing else bounds."""

import contextlib
import ctypes
import os
import resource
import select
import signal
import sys
import threading
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Final, NoReturn, TypeVar

import mujoco  # type: ignore[import-untyped]

from common.errors import ConfigurationError

Result = TypeVar("Result")

_MOST_BYTES: Final = 2 << 30
"""Memory that MuJoCo may take for a model"""
_MOST_CPU_S: Final = 20
"""Processor time, in seconds, that it may take"""
_LONGEST_S: Final = 120.0
"""Time, in seconds, that it may wait for the files that a model names"""
_PR_SET_PDEATHSIG: Final = 1
_ENDING: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_LONGEST: Final = 4096
_UNUSABLE: Final = "{}; valid: an MJCF file that MuJoCo compiles"
_TOO_LARGE: Final = "takes MuJoCo more than {} GB of memory, or makes it fail; valid: a smaller model"
_WITHOUT_REASON: Final = "Caught an unknown exception"
"""Error of MuJoCo where C++ has no memory left, for one"""
_TOO_SLOW: Final = "takes MuJoCo more than {} s of processor time; valid: a smaller model"


@cache
def try_model(path: Path) -> None:
    """Compile the model at `path` in a child process, with limits of memory and processor time; once for each path.

    ConfigurationError, of one line, if it cannot be compiled within them. Only Linux has these limits. The child is a
    fork, as importing MuJoCo takes longer than compiling most models. It ends with this process.
    """
    if sys.platform != "linux":
        return
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of other threads: the child takes none of their locks
        child = os.fork()
    if child == 0:
        _compile_and_leave(path, writing)
    os.close(writing)
    try:
        with os.fdopen(reading, "rb") as said:
            if not select.select([said], [], [], _LONGEST_S)[0]:
                os.kill(child, signal.SIGKILL)  # it may wait for a pipe that the model names
            why = said.read(_LONGEST).decode("utf-8", "replace")  # to the child's end
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    if code == -signal.SIGXCPU:
        why = _TOO_SLOW.format(_MOST_CPU_S)
    elif code < 0:
        why = _UNUSABLE.format(f"ends MuJoCo's compiler by {signal.Signals(-code).name}")
    if why:
        raise ConfigurationError(f"model {path.name}: {why}")


def unusable(error: Exception) -> ConfigurationError:
    """Return the error about a model that MuJoCo does not compile, in one line."""
    return ConfigurationError(f"model: {_why(error)}")


def _why(error: BaseException) -> str:
    return _UNUSABLE.format(" ".join(str(error).split()))


def hearing_signals(work: Callable[[], Result]) -> Result:
    """Return what `work` returns, done by a thread: meanwhile this one, the main one, hears signals."""
    done: list[Callable[[], Result]] = []

    def run() -> None:
        try:
            result = work()
        except BaseException as error:
            raised = error
            done.append(lambda: _raise(raised))
        else:
            done.append(lambda: result)

    thread = threading.Thread(target=run, daemon=True, name="model")
    thread.start()
    thread.join()
    return done[0]()


def _raise(error: BaseException) -> NoReturn:
    raise error


def _compile_and_leave(path: Path, writing: int) -> NoReturn:
    """In the child: compile within the limits, report what is wrong, and end."""
    why = ""
    try:
        for number in _ENDING:
            signal.signal(number, signal.SIG_DFL)
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        held = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_DATA, (held + _MOST_BYTES, held + _MOST_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (_MOST_CPU_S, _MOST_CPU_S + 1))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        warnings.simplefilter("ignore")  # they come again when the caller compiles
        model: Any = mujoco.MjSpec.from_file(str(path)).compile()
        with contextlib.suppress(mujoco.FatalError):  # what it cannot simulate, the caller says in better words
            mujoco.mj_forward(model, mujoco.MjData(model))
    except MemoryError:
        why = _TOO_LARGE.format(_MOST_BYTES >> 30)
    except BaseException as error:  # whatever it is, this process ends here
        why = _why(error)
        if _WITHOUT_REASON in why:
            why = _TOO_LARGE.format(_MOST_BYTES >> 30)
    finally:
        os.write(writing, why.encode("utf-8", "replace")[:_LONGEST])
        os._exit(0)
