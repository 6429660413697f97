import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from common.realtime import priority


def run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.processes
def test_every_thread_is_raised_not_only_the_one_that_asks() -> None:
    said = run(
        "import os, threading\nfrom common.realtime.priority import raise_priority\n"
        "waits = threading.Event()\n"
        "threading.Thread(target=waits.wait).start()\n"
        "granted = raise_priority()\n"
        "levels = {os.getpriority(os.PRIO_PROCESS, int(thread)) for thread in os.listdir('/proc/self/task')}\n"
        "print(granted, len(os.listdir('/proc/self/task')), len(levels))\n"
        "waits.set()"
    )
    assert said.endswith("2 1")


@pytest.mark.processes
@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="Linux groups no processes by session here")
def test_the_session_has_its_old_priority_afterwards() -> None:
    side = f"{sys.executable} -c 'from common.realtime.priority import raise_priority; raise_priority()'"
    said = subprocess.run(
        ["/bin/sh", "-c", f"cat /proc/self/autogroup; {side}; cat /proc/self/autogroup"],
        capture_output=True,
        text=True,
        check=True,
        start_new_session=True,
    ).stdout.splitlines()
    assert said[0] == said[1]


def test_a_process_from_before_the_first_session_has_none_to_raise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    of_none = tmp_path / "autogroup"
    of_none.touch()
    monkeypatch.setattr(priority, "_SESSION", of_none)
    monkeypatch.setattr(os, "setpriority", lambda *_: None)
    priority.raise_priority()
    assert of_none.read_text() == ""


@pytest.mark.processes
def test_what_a_companion_inherits_is_given_up_and_a_higher_niceness_stays() -> None:
    said = run(
        "import os\nfrom common.realtime.priority import lower_priority, raise_priority\n"
        "os.setsid()\nraise_priority()\n"
        "for niceness in (0, 7, 5):\n"
        "    lower_priority(niceness)\n"
        "    print(os.getpriority(os.PRIO_PROCESS, 0), os.sched_getscheduler(0) == os.SCHED_OTHER)"
    )
    assert said.splitlines() == ["0 True", "7 True", "7 True"]


@pytest.mark.processes
def test_realtime_is_granted_or_a_note_names_the_command_that_permits_it() -> None:
    said = run(
        "import os\nfrom common.realtime.priority import make_realtime\n"
        "notes = make_realtime()\nprint(os.sched_getscheduler(0) == os.SCHED_FIFO)\nprint(*notes, sep='\\n')"
    ).splitlines()
    granted, notes = said[0] == "True", said[1:]
    assert granted != any("real-time scheduling" in note for note in notes)
    assert all(re.search(r"--realtime: .* not permitted; to permit it: .*(sudo|docker)", note) for note in notes)


def test_what_is_not_permitted_is_noted_and_nothing_else_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(priority, "_lock_memory", lambda: False)
    notes = priority.make_realtime()
    assert len(notes) == 2
    assert all("\n" not in note for note in notes)
    assert "rtprio" in notes[0] or Path("/.dockerenv").exists()
