import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from common.command.stop_signal import StopSignal

BOTH = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """No signal reaches the runner, whatever a test finds out, and its own handlers come back."""
    before = {number: signal.signal(number, lambda *_: None) for number in BOTH}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", BOTH)
def test_a_signal_sets_the_flag_and_nothing_else(number: signal.Signals) -> None:
    with StopSignal() as stop:
        assert not stop.is_set
        signal.raise_signal(number)
        assert stop.is_set
        signal.raise_signal(number)
        assert stop.is_set


def test_the_program_may_ask_as_well() -> None:
    with StopSignal() as stop:
        stop.set()
        assert stop.is_set


@pytest.mark.parametrize("number", BOTH)
def test_the_old_handlers_come_back(number: signal.Signals) -> None:
    caught: list[int] = []
    signal.signal(number, lambda which, _: caught.append(which))
    with StopSignal() as stop:
        signal.raise_signal(number)
    assert caught == []
    signal.raise_signal(number)
    assert caught == [number]
    assert stop.is_set


def test_the_old_handlers_come_back_after_an_error_too() -> None:
    before = [signal.getsignal(number) for number in BOTH]
    with pytest.raises(RuntimeError, match="in the loop"), StopSignal():
        raise RuntimeError("in the loop")
    assert [signal.getsignal(number) for number in BOTH] == before


def test_the_inner_one_of_two_takes_the_signal() -> None:
    with StopSignal() as outer:
        with StopSignal() as inner:
            signal.raise_signal(signal.SIGTERM)
        assert (inner.is_set, outer.is_set) == (True, False)
        signal.raise_signal(signal.SIGTERM)
        assert outer.is_set


LOOP = """
import time
from common.command.stop_signal import StopSignal
with StopSignal() as stop:
    print("ready", flush=True)
    while not stop.is_set:
        time.sleep(0.01)
print("clean", flush=True)
"""


@pytest.mark.processes
@pytest.mark.parametrize("number", BOTH)
def test_a_process_ends_its_loop_the_clean_way(number: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", LOOP], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        rest, _ = process.communicate(timeout=600)
    assert rest == "clean\n"
    assert process.returncode == 0


# Reads one line so that it knows that its reader has gone, and writes until the pipe breaks.
WRITER = """
import sys
from common.command.stop_signal import ignore_broken_output
sys.stdin.readline()
try:
    while True:
        sys.stdout.write("status " * 100)
        sys.stdout.flush()
except BrokenPipeError:
    {handling}
"""


@pytest.mark.processes
@pytest.mark.parametrize(("handling", "quiet"), [("ignore_broken_output()", True), ("pass", False)])
def test_a_reader_that_went_away_leaves_no_complaint(handling: str, quiet: bool) -> None:
    """Without the call the interpreter's last flush would print a traceback and end with another code."""
    with subprocess.Popen(
        [sys.executable, "-c", WRITER.format(handling=handling)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Unbuffered there would be nothing left to flush.
        env={name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"},
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        process.stdin.write("gone\n")
        process.stdin.close()
        complaint = process.stderr.read()
        code = process.wait(timeout=600)
    assert (complaint == "") is quiet
    assert (code == 0) is quiet


@pytest.mark.processes
@pytest.mark.parametrize("number", BOTH)
def test_until_then_a_signal_ends_the_process_even_in_a_callback(number: signal.Signals) -> None:
    program = (
        "import ctypes, signal\n"
        "from common.command.stop_signal import leave_at_once_on_signals\n"
        "leave_at_once_on_signals()\n"
        f"call = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal({int(number)}))\n"
        "call()\n"
        "print('went on')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=600)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
