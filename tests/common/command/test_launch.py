import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from common.command.stop_signal import StopSignal
from common.extras import installing
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.python_process import ended, start
from tests.helpers.repository import ROOT

# The code stops at this point, so that the signal finds it however fast the machine is.
STOPPED_AT = """
import sys, time
sys.argv = ["command"]
import common.command.command_line
from common.command.launch import launch
def stop(*_):
    print("here", flush=True)
    while True:
        time.sleep(0.05)  # a signal right before a sleep does not shorten it
{}
"""
IMPORT = STOPPED_AT.format('launch("command", stop)')
START = STOPPED_AT.format('launch("command", lambda: stop)')
# Here the signal comes outside the command's own error handling, as it may between two statements.
END = STOPPED_AT.format('common.command.command_line.run_command = stop\nlaunch("command", lambda: None)')
# Here the signal comes in a callback from C, as of a compiler, which would lose an exception.
CALLBACK = STOPPED_AT.format('launch("command", lambda: __import__("ctypes").CFUNCTYPE(None)(stop)())')


@pytest.mark.processes
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("code", [IMPORT, START, END, CALLBACK])
def test_a_signal_while_it_starts_ends_it_quietly(code: str, number: signal.Signals) -> None:
    with start("-c", code) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "here\n"
        process.send_signal(number)
        _, complaint = process.communicate(timeout=LIMIT_S)
    assert (process.returncode, complaint) == (0, "")


@pytest.mark.processes
@pytest.mark.parametrize(
    ("flags", "where", "file"),
    [
        *((["--summary", "new.json"], where, "new.json") for where in (IMPORT, START)),
        (["--summary=other.json", "--summary=new.json"], IMPORT, "new.json"),
        *(([flag], IMPORT, None) for flag in ("--summary=None", "--summary=", "--summary")),
    ],
)
def test_a_run_that_never_began_has_a_summary_where_one_is_asked_for(
    tmp_path: Path, flags: list[str], where: str, file: str | None
) -> None:
    code = where.replace('["command"]', repr(["command", *flags])).replace("stop)", "stop, has_summary=True)")
    with start("-c", f"import os; os.chdir({str(tmp_path)!r})" + code) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "here\n"
        process.send_signal(signal.SIGTERM)
        assert process.wait(LIMIT_S) == 0
    summary = {"duration_s": 0.0, "ticks": 0, "stops": [], "errors": []}
    written = {path.name: json.loads(path.read_text()) for path in tmp_path.iterdir()}
    assert written == ({} if file is None else {file: summary})


BOTH = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def handlers() -> Iterator[None]:
    """Replace the test runner's signal handlers, so that no signal of a test reaches them; restore them afterwards."""
    before = {number: signal.signal(number, lambda *_: None) for number in BOTH}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("number", BOTH)
@pytest.mark.parametrize("fails", [False, True])
def test_a_signal_sets_the_flag_and_the_old_handler_comes_back(number: signal.Signals, fails: bool) -> None:
    caught: list[int] = []
    signal.signal(number, lambda which, _: caught.append(which))
    with contextlib.suppress(RuntimeError), StopSignal() as stop:
        assert not stop.is_set
        for _ in range(2):
            signal.raise_signal(number)
            assert stop.is_set
        if fails:
            raise RuntimeError("in the loop")
    assert caught == []
    signal.raise_signal(number)
    assert caught == [number]


WITHOUT_MUJOCO = """
import sys
sys.modules["mujoco"] = None
sys.argv = ["feelahead-robot"]
from robot_side.__main__ import main
main()
"""


@pytest.mark.processes
def test_a_machine_without_mujoco_is_told_what_to_install() -> None:
    code, _, complaint = ended("-c", WITHOUT_MUJOCO)
    assert code == 2
    assert complaint == f"feelahead-robot: mujoco is not installed; to install it: {installing('robot')}\n"


@pytest.mark.processes
def test_a_module_of_ours_that_is_missing_is_a_fault_and_not_an_installation() -> None:
    program = "from common.command.launch import launch\nlaunch('x', lambda: __import__('common.nothing'))"
    code, _, complaint = ended("-c", program)
    assert code == 1
    assert "ModuleNotFoundError" in complaint


@pytest.mark.processes
def test_characters_that_the_terminal_lacks_do_not_end_the_command() -> None:
    code = (
        "from common.command.launch import launch\n"
        "launch('x', lambda: lambda arguments: print('5 \\u00b1 1 \\u00b5s') or 0)"
    )
    assert ended("-c", code, PYTHONIOENCODING="ascii", PYTHONUTF8="0", LC_ALL="C") == (0, "5 ? 1 ?s\n", "")


@pytest.mark.processes
def test_a_reader_that_goes_away_is_no_fault() -> None:
    code = "from common.command.command_line import run_command\nrun_command('x', lambda _: print('a' * 100_000) or 0)"
    with start("-c", code) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.wait(LIMIT_S) == 0
        assert process.stderr.read() == ""


PRINT = "from common.command.command_line import run_command\nrun_command('x', lambda _: print('a' * {length}) or 0)"
HELP = "from common.command.command_line import run_command\nrun_command('x', lambda _: print('help') or exit(0))"
VERSION = (
    "import sys; sys.argv = ['x', '--version']\nfrom common.command.launch import launch\nlaunch('x', lambda: None)"
)


@pytest.mark.processes
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("code", [PRINT.format(length=1), PRINT.format(length=100_000), HELP, VERSION])
def test_an_output_that_cannot_be_written_is_one_line(code: str) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-c", code], stdout=full, stderr=subprocess.PIPE, text=True, cwd=ROOT, check=False
        )
    assert done.returncode == 1
    assert done.stderr == (
        "x: the output cannot be written: No space left on device; valid: an output with enough room\n"
    )


@pytest.mark.processes
def test_closed_streams_become_the_null_device(tmp_path: Path) -> None:
    program, said = tmp_path / "program.py", tmp_path / "said"
    program.write_text(
        "import sys\n"
        "from common.command.launch import launch\n"
        "def command(_):\n"
        "    file = open(sys.argv[1], 'w')\n"
        "    print(sys.stdin.isatty(), sys.stdout.isatty(), file.fileno() > 2, file=file)\n"
        "    print('lost')\n"
        "    return 0\n"
        "launch('x', lambda: command)\n"
    )
    words = f"exec '{sys.executable}' '{program}' '{said}' <&- >&- 2>&-"
    assert subprocess.call(["/bin/sh", "-c", words], env=os.environ | {"PYTHONPATH": str(ROOT)}) == 0
    assert said.read_text() == "False False True\n"


@pytest.mark.processes
@pytest.mark.parametrize(("cause", "code"), [("KeyboardInterrupt", 0), ("OSError", 1)])
def test_an_interrupted_late_import_ends_quietly_and_a_broken_one_does_not(cause: str, code: int) -> None:
    program = (
        "from common.command.launch import launch\n"
        "def command(_):\n"
        f"    raise ImportError('initialization failed') from {cause}()\n"
        "launch('x', lambda: command)"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (code, code == 1)
