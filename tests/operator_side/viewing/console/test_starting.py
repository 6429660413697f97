"""Another console process is started in a thread: without the side's priority, and never left behind."""

import contextlib
import os
import sys
import threading
from collections.abc import Iterator

import pytest

from operator_side.viewing.console import console as module
from operator_side.viewing.console.console import Console
from tests.helpers.machines.waiting import LIMIT_S


class Channel:
    """Stand-in for a channel that sends nothing."""

    def __init__(self) -> None:
        self.ended = False
        self.waiting = 0

    def send(self, *_: bytes) -> bool:
        return True

    def flush(self) -> None:
        pass

    def receive(self) -> list[bytes]:
        return []


class Started:
    """Stand-in for a companion, whose start waits for `go`, but for the first."""

    go = threading.Event()
    all: list["Started"] = []  # noqa: RUF012  # the module under test makes them

    def __init__(self, _: str) -> None:
        self.channel, self.closed = Channel(), threading.Event()
        if sys.platform == "linux":
            self.scheduling = os.sched_getscheduler(0)
        self.niceness = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
        Started.all.append(self)
        if len(Started.all) > 1:
            assert Started.go.wait(LIMIT_S)

    def close(self, _: float) -> bool:
        self.closed.set()
        return True


@pytest.fixture
def again(monkeypatch: pytest.MonkeyPatch) -> Iterator[Console]:
    """Yield a console whose process has ended, and whose next one is being started."""
    monkeypatch.setattr(module, "Companion", Started)
    Started.go.clear()
    Started.all.clear()
    console = Console("a test")
    Started.all[0].channel.ended = True
    console.receive(1.0)
    yield console
    Started.go.set()
    if console._starting is not None:
        console._starting.join(LIMIT_S)


@pytest.mark.parametrize("when", ["before", "during", "after its limit"])
def test_a_process_that_starts_as_the_console_closes_ends_with_it(
    again: Console, when: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It starts before, and nobody has taken it yet; while close waits; or once close has given up."""
    monkeypatch.setattr(module, "_END_LIMIT_S", 0.0 if when == "after its limit" else LIMIT_S)
    again.receive(9.0)
    assert again._starting is not None
    if when == "before":
        Started.go.set()
        again._starting.join(LIMIT_S)
    elif when == "during":
        monkeypatch.setattr(Started.all[0], "close", lambda _: Started.go.set())
    again.close()
    if when == "after its limit":
        Started.go.set()
        again._starting.join(LIMIT_S)
    assert [one.closed.is_set() for one in Started.all[1:]] == [True]


@pytest.mark.skipif(sys.platform != "linux", reason="scheduling of one thread is Linux's")
def test_a_process_that_is_started_again_does_not_inherit_the_sides_priority(again: Console) -> None:
    """SCHED_BATCH in place of SCHED_FIFO, as anybody may set it."""
    own, before = threading.get_native_id(), os.sched_getscheduler(0)
    niceness = os.getpriority(os.PRIO_PROCESS, own)
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, own, -5)
    try:
        again.receive(9.0)
    finally:
        os.sched_setscheduler(0, before, os.sched_param(0))
        with contextlib.suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, own, niceness)
    Started.go.set()
    assert again._starting is not None
    again._starting.join(LIMIT_S)
    assert Started.all[1].scheduling == os.SCHED_OTHER
    assert Started.all[1].niceness >= 0
